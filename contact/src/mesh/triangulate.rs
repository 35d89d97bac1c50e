//! Triangulation of a polygon with holes by bridging and ear clipping.
//!
//! Source: D. Eberly, *Triangulation by Ear Clipping* (2002, revised 2015). In the worst case, a spiral, the time grows
//! with the cube of the number of points; `holes` limits that number for outlines from files.

use super::polygon::{Point, signed_area_m2, turn};

/// Triangles, as indices into the concatenation `outer`, `holes[0]`, `holes[1]`…, all counter-clockwise whatever the
/// direction of the loops. Loops must be simple and holes must lie inside `outer`; other input gives triangles that
/// do not tile the polygon, but always returns.
pub(super) fn triangulate(outer: &[Point], holes: &[Vec<Point>]) -> Vec<[usize; 3]> {
    let mut points: Vec<Point> = outer.to_vec();
    let mut loop_: Vec<usize> = directed(outer, 0, true);
    let mut rest: Vec<Vec<usize>> = Vec::new();
    for hole in holes {
        rest.push(directed(hole, points.len(), false));
        points.extend_from_slice(hole);
    }
    // furthest right first, so that no bridge has to pass a hole that is still apart
    let rightmost = |hole: &Vec<usize>| hole.iter().map(|&i| points[i][0]).fold(f64::NEG_INFINITY, f64::max);
    rest.sort_by(|a, b| rightmost(b).total_cmp(&rightmost(a)));
    while !rest.is_empty() {
        let hole = rest.remove(0);
        loop_ = bridged(&points, loop_, &hole, &rest);
    }
    clip_ears(&points, loop_)
}

fn directed(outline: &[Point], base: usize, counter_clockwise: bool) -> Vec<usize> {
    let mut indices: Vec<usize> = (base..base + outline.len()).collect();
    if (signed_area_m2(outline) > 0.0) != counter_clockwise {
        indices.reverse();
    }
    indices
}

/// `loop_` with `hole` spliced in over the shortest bridge that crosses nothing.
fn bridged(points: &[Point], loop_: Vec<usize>, hole: &[usize], rest: &[Vec<usize>]) -> Vec<usize> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, &p) in loop_.iter().enumerate() {
        for (j, &q) in hole.iter().enumerate() {
            let d = (points[p][0] - points[q][0]).hypot(points[p][1] - points[q][1]);
            pairs.push((d, i, j));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let crosses = |p: usize, q: usize, ring: &[usize]| {
        (0..ring.len()).any(|k| {
            let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
            properly_cross(points[p], points[q], points[a], points[b])
        })
    };
    let free = pairs.iter().find(|&&(_, i, j)| {
        let (p, q) = (loop_[i], hole[j]);
        !crosses(p, q, &loop_) && !crosses(p, q, hole) && !rest.iter().any(|other| crosses(p, q, other))
    });
    let Some(&(_, i, j)) = free.or_else(|| pairs.first()) else {
        return loop_;
    };
    let around_hole = (0..=hole.len()).map(|k| hole[(j + k) % hole.len()]);
    let mut out = loop_[..=i].to_vec();
    out.extend(around_hole);
    out.extend_from_slice(&loop_[i..]);
    out
}

/// Whether the open segments pq and ab cross at a point inside both.
fn properly_cross(p: Point, q: Point, a: Point, b: Point) -> bool {
    turn(p, q, a) * turn(p, q, b) < 0.0 && turn(a, b, p) * turn(a, b, q) < 0.0
}

fn clip_ears(points: &[Point], mut loop_: Vec<usize>) -> Vec<[usize; 3]> {
    let mut out = Vec::with_capacity(loop_.len());
    let mut at = 0;
    let mut misses = 0;
    while loop_.len() > 3 {
        let n = loop_.len();
        let corner = [loop_[(at + n - 1) % n], loop_[at % n], loop_[(at + 1) % n]];
        // after a full fruitless turn the loop is not simple (or only slivers are left): take what is there
        if misses > n || is_ear(points, &loop_, corner) {
            out.push(corner);
            loop_.remove(at % n);
            misses = 0;
            // step on, so that ears come from all around and the triangles stay compact
            at = (at + 1) % loop_.len();
        } else {
            misses += 1;
            at = (at + 1) % n;
        }
    }
    if let [a, b, c] = loop_[..] {
        out.push([a, b, c]);
    }
    out
}

fn is_ear(points: &[Point], loop_: &[usize], [a, b, c]: [usize; 3]) -> bool {
    let [pa, pb, pc] = [points[a], points[b], points[c]];
    if turn(pa, pb, pc) <= 0.0 {
        return false;
    }
    // the two copies of a bridge's ends coincide with corners and must not block
    let is_corner = |p: Point| [pa, pb, pc].iter().any(|q| (p[0] - q[0]).hypot(p[1] - q[1]) <= 0.0);
    let inside = |p: Point| turn(pa, pb, p) >= 0.0 && turn(pb, pc, p) >= 0.0 && turn(pc, pa, p) >= 0.0;
    !loop_.iter().map(|&i| points[i]).any(|p| inside(p) && !is_corner(p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{circle, placed, rectangle};
    use approx::assert_relative_eq;

    fn area(points: &[Point], triangles: &[[usize; 3]]) -> f64 {
        triangles
            .iter()
            .map(|t| 0.5 * turn(points[t[0]], points[t[1]], points[t[2]]))
            .sum()
    }

    /// n points and h holes give n + 2h − 2 triangles, none turned over, that cover the area.
    #[test]
    fn tiles_polygons_with_holes() {
        let outer = rectangle(10.0, 6.0);
        let holes: Vec<Vec<Point>> = [[-3.0, 0.0], [0.0, 1.0], [3.0, -1.0]]
            .into_iter()
            .map(|c| placed(&circle(1.0, 12), 0.3, c))
            .collect();
        let points: Vec<Point> = outer.iter().chain(holes.iter().flatten()).copied().collect();
        let triangles = triangulate(&outer, &holes);
        assert_eq!(triangles.len(), points.len() + 2 * holes.len() - 2);
        assert!(
            triangles
                .iter()
                .all(|t| turn(points[t[0]], points[t[1]], points[t[2]]) > 0.0)
        );
        let expected = 60.0 - holes.iter().map(|h| signed_area_m2(h)).sum::<f64>();
        assert_relative_eq!(area(&points, &triangles), expected, max_relative = 1e-12);
    }

    #[test]
    fn concave_and_clockwise() {
        let mut outline = vec![
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [3.0, 4.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 4.0],
            [0.0, 4.0],
        ];
        assert_relative_eq!(area(&outline, &triangulate(&outline, &[])), 10.0, max_relative = 1e-12);
        outline.reverse();
        assert_relative_eq!(area(&outline, &triangulate(&outline, &[])), 10.0, max_relative = 1e-12);
    }

    #[test]
    fn returns_on_nonsense() {
        assert!(triangulate(&[], &[]).is_empty());
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert!(!triangulate(&bow, &[]).is_empty());
    }

    /// A band along a spiral of five turns, whose two long sides block each other's ears all the way.
    #[test]
    fn tiles_a_spiral() {
        let side = |k: u32, out: f64| {
            let turns = 5.0 * f64::from(k) / 199.0;
            let (y, x) = (std::f64::consts::TAU * turns).sin_cos();
            let r = 1.0 + turns + out;
            [r * x, r * y]
        };
        let inner = (0..200).rev().map(|k| side(k, 0.0));
        let outline: Vec<Point> = (0..200).map(|k| side(k, 0.5)).chain(inner).collect();
        let triangles = triangulate(&outline, &[]);
        assert_eq!(triangles.len(), outline.len() - 2);
        let turns = |t: &[usize; 3]| turn(outline[t[0]], outline[t[1]], outline[t[2]]);
        assert!(triangles.iter().all(|t| turns(t) > 0.0));
        assert_relative_eq!(
            area(&outline, &triangles),
            signed_area_m2(&outline).abs(),
            max_relative = 1e-12
        );
    }
}
