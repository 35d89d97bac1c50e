//! Outlines in the plane: closed loops of points, m, counter-clockwise; the first point is not repeated at the end.

use std::f64::consts::TAU;

/// A point or direction in the plane, m.
pub type Point = [f64; 2];

fn ratio(i: usize, n: usize) -> f64 {
    i as f64 / n as f64
}

/// Rectangle of `width_m` (x) by `height_m` (y), centred on the origin.
#[must_use]
pub fn rectangle(width_m: f64, height_m: f64) -> Vec<Point> {
    let (x, y) = (0.5 * width_m, 0.5 * height_m);
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

/// Ellipse with half axes `a_m` (x) and `b_m` (y), centred on the origin, as a polygon with `sides` points.
#[must_use]
pub fn ellipse(a_m: f64, b_m: f64, sides: usize) -> Vec<Point> {
    (0..sides)
        .map(|i| {
            let (s, c) = (TAU * ratio(i, sides)).sin_cos();
            [a_m * c, b_m * s]
        })
        .collect()
}

/// Circle of `radius_m`, centred on the origin, as a polygon with `sides` points.
#[must_use]
pub fn circle(radius_m: f64, sides: usize) -> Vec<Point> {
    ellipse(radius_m, radius_m, sides)
}

/// Equilateral triangle of side `side_m`, centroid at the origin, apex towards +y.
#[must_use]
pub fn triangle(side_m: f64) -> Vec<Point> {
    let height = side_m * 0.75_f64.sqrt();
    let half = 0.5 * side_m;
    vec![[-half, -height / 3.0], [half, -height / 3.0], [0.0, height * 2.0 / 3.0]]
}

/// Replaces the convex corners of `outline` by arcs of `radius_m` with `steps` segments each. The radius is reduced
/// where a side is too short for it.
///
/// ```
/// use spts_contact::mesh::polygon::{rectangle, rounded, signed_area_m2};
///
/// let sharp = rectangle(40e-3, 20e-3);
/// let round = rounded(&sharp, 5e-3, 16);
/// // each corner loses r² − πr²/4
/// let lost_m2 = (4.0 - std::f64::consts::PI) * 5e-3 * 5e-3;
/// assert!((signed_area_m2(&sharp) - signed_area_m2(&round) - lost_m2).abs() < 0.01 * lost_m2);
/// ```
#[must_use]
pub fn rounded(outline: &[Point], radius_m: f64, steps: usize) -> Vec<Point> {
    let n = outline.len();
    let mut out = Vec::with_capacity(n * (steps + 1));
    for i in 0..n {
        let (before, at, after) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
        let (u, u_len) = unit(at, before);
        let (v, v_len) = unit(at, after);
        let convex = turn(before, at, after) > 0.0;
        let half = 0.5 * (u[0] * v[0] + u[1] * v[1]).clamp(-1.0, 1.0).acos();
        if !convex || half < 1e-6 || radius_m <= 0.0 || steps == 0 {
            out.push(at);
            continue;
        }
        let cut = (radius_m / half.tan()).min(0.45 * u_len.min(v_len));
        let radius = cut * half.tan();
        let reach = radius / half.sin();
        let (axis, _) = unit([0.0; 2], [u[0] + v[0], u[1] + v[1]]);
        let centre = [at[0] + axis[0] * reach, at[1] + axis[1] * reach];
        let start = [at[0] + u[0] * cut - centre[0], at[1] + u[1] * cut - centre[1]];
        let sweep = std::f64::consts::PI - 2.0 * half;
        for k in 0..=steps {
            let (s, c) = (sweep * ratio(k, steps)).sin_cos();
            out.push([
                centre[0] + c * start[0] - s * start[1],
                centre[1] + s * start[0] + c * start[1],
            ]);
        }
    }
    out
}

/// Outline between the curves y = `low_m(x)` and y = `high_m(x)` over `from_m ≤ x ≤ to_m`, in `steps` equal steps. If
/// the curves meet at an end, their two points there become one.
#[must_use]
pub fn between(
    [from_m, to_m]: Point,
    steps: usize,
    low_m: impl Fn(f64) -> f64,
    high_m: impl Fn(f64) -> f64,
) -> Vec<Point> {
    let at = |i: usize| from_m + (to_m - from_m) * ratio(i, steps);
    let mut out: Vec<Point> = (0..=steps).map(|i| [at(i), low_m(at(i))]).collect();
    let tip = |i: usize| (high_m(at(i)) - low_m(at(i))).abs() < 1e-9;
    let back = (0..=steps).rev().filter(|&i| !((i == 0 || i == steps) && tip(i)));
    out.extend(back.map(|i| [at(i), high_m(at(i))]));
    out
}

/// Rotates `outline` by `angle_rad` about the origin, then moves it by `offset_m`.
#[must_use]
pub fn placed(outline: &[Point], angle_rad: f64, offset_m: Point) -> Vec<Point> {
    let (s, c) = angle_rad.sin_cos();
    outline
        .iter()
        .map(|p| [c * p[0] - s * p[1] + offset_m[0], s * p[0] + c * p[1] + offset_m[1]])
        .collect()
}

/// Enclosed area, m²; negative for a clockwise loop.
#[must_use]
pub fn signed_area_m2(outline: &[Point]) -> f64 {
    let n = outline.len();
    (0..n)
        .map(|i| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            0.5 * (a[0] * b[1] - b[0] * a[1])
        })
        .sum()
}

/// Twice the area of the triangle a, b, c: positive for a left turn at b.
pub(super) fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Direction from `a` to `b` and the distance; zero direction for coinciding points.
fn unit(a: Point, b: Point) -> (Point, f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = d[0].hypot(d[1]);
    if length > 0.0 {
        ([d[0] / length, d[1] / length], length)
    } else {
        ([0.0; 2], 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn areas() {
        assert_relative_eq!(signed_area_m2(&rectangle(2.0, 3.0)), 6.0);
        assert_relative_eq!(signed_area_m2(&triangle(2.0)), 3.0_f64.sqrt(), max_relative = 1e-12);
        // a regular n-gon has n/2 sin(2π/n) of the circle's r²
        assert_relative_eq!(
            signed_area_m2(&circle(1.0, 64)),
            32.0 * (TAU / 64.0).sin(),
            max_relative = 1e-12
        );
        // a rounded corner of 90° loses (1 − π/4) r²; an arc of k chords a little more
        let round = signed_area_m2(&rounded(&rectangle(4.0, 4.0), 1.0, 200));
        assert_relative_eq!(round, 12.0 + std::f64::consts::PI, max_relative = 1e-4);
        let band = between([0.0, 2.0], 5, |x| x - 0.25, |x| x + 0.25);
        assert_relative_eq!(signed_area_m2(&band), 1.0, max_relative = 1e-12);
        assert_eq!(between([0.0, 2.0], 2, |_| 0.0, |x| x * (2.0 - x)).len(), 4);
        assert_relative_eq!(
            signed_area_m2(&placed(&band, 1.0, [3.0, 4.0])),
            1.0,
            max_relative = 1e-12
        );
    }
}
