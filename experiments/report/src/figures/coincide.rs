//! Curves that lie on each other: the later one is dashed and its markers stand between, so that both are seen.

use super::draw::Point;

/// Distance below which two curves cannot be told apart, CSS pixels.
const APART: f64 = 2.0;
/// Share of the points that must be that near.
const SHARE: f64 = 0.8;

/// Dash and gap of a curve that lies on `below` others: the gaps show what is below.
pub(super) fn dash(below: usize) -> Option<(f64, f64)> {
    (below > 0).then_some((9.0, 9.0 + 4.0 * below as f64))
}

/// How many of `earlier` the curve `places` lies on.
pub(super) fn below(places: &[Point], earlier: &[Vec<Point>]) -> usize {
    earlier.iter().filter(|other| same(places, other)).count()
}

/// Whether two curves have points at the same columns, and most of them at the same heights.
fn same(a: &[Point], b: &[Point]) -> bool {
    let near = |p: &&Point| b.iter().any(|q| (p.0 - q.0).abs() < APART && (p.1 - q.1).abs() < APART);
    a.len() > 1 && b.len() > 1 && a.iter().filter(near).count() as f64 >= SHARE * a.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_curves_are_found_and_others_are_not() {
        let line = |height: f64| -> Vec<Point> { (0..10).map(|i| (f64::from(i) * 20.0, height)).collect() };
        let drawn = [line(50.0), line(51.0), line(80.0)];
        assert_eq!(below(&line(50.0), &drawn), 2);
        assert_eq!(below(&line(60.0), &drawn), 0);
        assert_eq!(below(&[(0.0, 50.0)], &drawn), 0);
        assert!(dash(0).is_none() && dash(1).is_some());
    }
}
