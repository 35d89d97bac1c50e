//! Outlines in the plane: closed loops of points, m, counter-clockwise; the first point is not repeated at the end.

use super::tri_mesh::span;
use std::f64::consts::TAU;

/// A point or direction in the plane, m.
pub type Point = [f64; 2];

fn ratio(i: usize, n: usize) -> f64 {
    i as f64 / n as f64
}

/// Rectangle of `width_m` (x) by `height_m` (y), centred on the origin.
pub fn rectangle(width_m: f64, height_m: f64) -> Vec<Point> {
    let (x, y) = (0.5 * width_m, 0.5 * height_m);
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}

/// Ellipse with half axes `a_m` (x) and `b_m` (y), centred on the origin, as a polygon with `sides` points.
pub fn ellipse(a_m: f64, b_m: f64, sides: usize) -> Vec<Point> {
    (0..sides)
        .map(|i| {
            let (s, c) = (TAU * ratio(i, sides)).sin_cos();
            [a_m * c, b_m * s]
        })
        .collect()
}

/// Circle of `radius_m`, centred on the origin, as a polygon with `sides` points.
pub fn circle(radius_m: f64, sides: usize) -> Vec<Point> {
    ellipse(radius_m, radius_m, sides)
}

/// Equilateral triangle of side `side_m`, centroid at the origin, apex towards +y.
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
            out.push([centre[0] + c * start[0] - s * start[1], centre[1] + s * start[0] + c * start[1]]);
        }
    }
    out
}

/// Outline between the curves y = `low_m(x)` and y = `high_m(x)` over `from_m ≤ x ≤ to_m`, in `steps` equal steps. If
/// the curves meet at an end, their two points there become one.
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
pub fn placed(outline: &[Point], angle_rad: f64, offset_m: Point) -> Vec<Point> {
    let (s, c) = angle_rad.sin_cos();
    outline.iter().map(|p| [c * p[0] - s * p[1] + offset_m[0], s * p[0] + c * p[1] + offset_m[1]]).collect()
}

/// Enclosed area, m²; negative for a clockwise loop.
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
    if length > 0.0 { ([d[0] / length, d[1] / length], length) } else { ([0.0; 2], 0.0) }
}

// Triangulation of a polygon with holes by bridging and ear clipping.
//
// Source: D. Eberly, *Triangulation by Ear Clipping* (2002, revised 2015). In the worst case, a spiral, the time grows
// with the cube of the number of points; the check of meshes limits that number for outlines from files.

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

/// Triangles, as indices into `outline`, that tile it: a fan where all of it is seen from its first corner, else by
/// ears. The outline runs counter-clockwise; its corners may be repeated or lie on a straight line, and it may touch
/// itself. `may_take` says whether the ears of so many corners may be looked for.
///
/// # Errors
/// What is wrong with an outline that cannot be tiled.
pub(super) fn cut(outline: &[Point], may_take: impl FnOnce(usize) -> bool) -> Result<Vec<[usize; 3]>, &'static str> {
    let n = outline.len();
    let [low, high] = span(outline.iter().copied());
    // rounding of coordinates a million times as far away as the outline is wide
    let slack_m2 = 1e-9 * (high[0] - low[0]).max(high[1] - low[1]).powi(2);
    let area = |&[a, b, c]: &[usize; 3]| 0.5 * turn(outline[a], outline[b], outline[c]);
    let from_first = |k: usize| [outline[k][0] - outline[0][0], outline[k][1] - outline[0][1]];
    let fan: Vec<[usize; 3]> = (2..n).map(|k| [0, k - 1, k]).collect();
    let angle = |&[_, b, c]: &[usize; 3]| {
        let (p, q) = (from_first(b), from_first(c));
        (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1])
    };
    if fan.iter().all(|t| area(t) >= -slack_m2) && fan.iter().map(angle).sum::<f64>() < 1.01 * TAU {
        return Ok(fan);
    }
    if !may_take(n) {
        return Err("is concave, and the concave faces have more corners than can be cut; export triangles");
    }
    let side = |k: usize| (outline[k], outline[(k + 1) % n]);
    let crosses = (0..n).any(|i| {
        let (p, q) = side(i);
        (i + 1..n).map(side).any(|(a, b)| properly_cross(p, q, a, b))
    });
    let triangles = triangulate(outline, &[]);
    let missing_m2 = signed_area_m2(outline) - triangles.iter().map(area).sum::<f64>();
    let tiled = triangles.iter().all(|t| area(t) >= -slack_m2) && missing_m2.abs() <= n as f64 * slack_m2;
    if crosses || !tiled {
        return Err("crosses itself, so that it has no inside; export triangles");
    }
    Ok(triangles)
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
        let corner = |k: usize| [n - 1, 0, 1].map(|step| loop_[(k + step) % n]);
        let flatness = |k: usize| {
            let [a, b, c] = corner(k).map(|i| points[i]);
            turn(a, b, c).abs()
        };
        let turns_back = |k: &usize| {
            let [a, _, c] = corner(*k).map(|i| points[i]);
            (a[0] - c[0]).hypot(a[1] - c[1]) <= 0.0
        };
        let ear = if let Some(tip) = (0..n).find(turns_back) {
            // there and back: it has no area, and both its sides would look like those of an ear
            tip
        } else if misses > n {
            // no ear in a full turn: corners without area block them, or the loop is not simple
            (0..n).min_by(|&j, &k| flatness(j).total_cmp(&flatness(k))).unwrap_or_default()
        } else if is_ear(points, &loop_, corner(at % n)) {
            at % n
        } else {
            misses += 1;
            at = (at + 1) % n;
            continue;
        };
        out.push(corner(ear));
        loop_.remove(ear);
        misses = 0;
        // step on, so that ears come from all around and the triangles stay compact
        at = (ear + 1) % loop_.len();
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
    use approx::assert_relative_eq;

    #[test]
    fn areas() {
        assert_relative_eq!(signed_area_m2(&rectangle(2.0, 3.0)), 6.0);
        assert_relative_eq!(signed_area_m2(&triangle(2.0)), 3.0_f64.sqrt(), max_relative = 1e-12);
        // a regular n-gon has n/2 sin(2π/n) of the circle's r²
        assert_relative_eq!(signed_area_m2(&circle(1.0, 64)), 32.0 * (TAU / 64.0).sin(), max_relative = 1e-12);
        // a rounded corner of 90° loses (1 − π/4) r²; an arc of k chords a little more
        let round = signed_area_m2(&rounded(&rectangle(4.0, 4.0), 1.0, 200));
        assert_relative_eq!(round, 12.0 + std::f64::consts::PI, max_relative = 1e-4);
        let band = between([0.0, 2.0], 5, |x| x - 0.25, |x| x + 0.25);
        assert_relative_eq!(signed_area_m2(&band), 1.0, max_relative = 1e-12);
        assert_eq!(between([0.0, 2.0], 2, |_| 0.0, |x| x * (2.0 - x)).len(), 4);
        assert_relative_eq!(signed_area_m2(&placed(&band, 1.0, [3.0, 4.0])), 1.0, max_relative = 1e-12);
    }

    fn area(points: &[Point], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|t| 0.5 * turn(points[t[0]], points[t[1]], points[t[2]])).sum()
    }

    /// n points and h holes give n + 2h − 2 triangles, none turned over, that cover the area.
    #[test]
    fn tiles_polygons_with_holes() {
        let outer = rectangle(10.0, 6.0);
        let holes: Vec<Vec<Point>> =
            [[-3.0, 0.0], [0.0, 1.0], [3.0, -1.0]].into_iter().map(|c| placed(&circle(1.0, 12), 0.3, c)).collect();
        let points: Vec<Point> = outer.iter().chain(holes.iter().flatten()).copied().collect();
        let triangles = triangulate(&outer, &holes);
        assert_eq!(triangles.len(), points.len() + 2 * holes.len() - 2);
        assert!(triangles.iter().all(|t| turn(points[t[0]], points[t[1]], points[t[2]]) > 0.0));
        let expected = 60.0 - holes.iter().map(|h| signed_area_m2(h)).sum::<f64>();
        assert_relative_eq!(area(&points, &triangles), expected, max_relative = 1e-12);
    }

    #[test]
    fn concave_and_clockwise() {
        let mut outline =
            vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, 4.0], [3.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
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
        assert_relative_eq!(area(&outline, &triangles), signed_area_m2(&outline).abs(), max_relative = 1e-12);
    }
}
