//! Rounded corners of an outline.

use crate::mesh::polygon::Point;

/// A turn below this is part of a curve, not a corner, rad. Curves are drawn with at least twelve sides a turn.
const LEAST_TURN_RAD: f64 = 0.7;
/// Number of points from which on corners are cut by one chord: those of teeth, of which no field sees the shape.
const MANY_CORNERS: usize = 24;
/// Largest share of a side that the arc at one of its ends takes.
const MOST_OF_SIDE: f64 = 0.45;

/// Every corner of `outline`, convex or concave, replaced by an arc of `radius_m`, in steps of 30°, or by one chord
/// where there are many corners. The radius is reduced where a side is too short for it.
pub(super) fn rounded(outline: &[Point], radius_m: f64) -> Vec<Point> {
    let n = outline.len();
    let step_rad = if n > MANY_CORNERS { 1.6 } else { 0.53 };
    let mut out = Vec::with_capacity(4 * n);
    for i in 0..n {
        let at = outline[i];
        let ([ux, uy], before_m) = towards(at, outline[(i + n - 1) % n]);
        let ([vx, vy], after_m) = towards(at, outline[(i + 1) % n]);
        // angle between the sides, and the turn from one to the next
        let between = (ux * vx + uy * vy).clamp(-1.0, 1.0).acos();
        let turn = std::f64::consts::PI - between;
        if turn < LEAST_TURN_RAD || between < 0.05 {
            out.push(at);
            continue;
        }
        let tan = (0.5 * between).tan();
        let cut_m = (radius_m / tan).min(MOST_OF_SIDE * before_m.min(after_m));
        let reach_m = cut_m / (0.5 * between).cos();
        let length = ((ux + vx).powi(2) + (uy + vy).powi(2)).sqrt();
        let centre = [
            at[0] + (ux + vx) / length * reach_m,
            at[1] + (uy + vy) / length * reach_m,
        ];
        let start = [at[0] + ux * cut_m - centre[0], at[1] + uy * cut_m - centre[1]];
        // left turns of a loop are counter-clockwise arcs
        let sign = if uy * vx - ux * vy > 0.0 { 1.0 } else { -1.0 };
        let steps = (turn / step_rad).ceil();
        let mut k = 0.0;
        while k <= steps {
            let (s, c) = (sign * turn * k / steps).sin_cos();
            out.push([
                centre[0] + c * start[0] - s * start[1],
                centre[1] + s * start[0] + c * start[1],
            ]);
            k += 1.0;
        }
    }
    out
}

/// Direction from `a` to `b` and the distance.
fn towards(a: Point, b: Point) -> (Point, f64) {
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = (d[0] * d[0] + d[1] * d[1]).sqrt().max(f64::MIN_POSITIVE);
    ([d[0] / length, d[1] / length], length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{circle, rectangle, signed_area_m2};
    use approx::assert_relative_eq;

    /// Three chords of 30° of a quarter circle of radius 1 enclose 3/2 sin 30° = 0.75 instead of the corner's 1.
    #[test]
    fn corners_lose_area_and_notches_gain_it() {
        let square = rounded(&rectangle(4.0, 4.0), 1.0);
        assert_eq!(square.len(), 16);
        assert_relative_eq!(signed_area_m2(&square), 16.0 - 4.0 * 0.25, max_relative = 1e-12);
        let mut hole = rectangle(4.0, 4.0);
        hole.reverse();
        assert_relative_eq!(signed_area_m2(&rounded(&hole, 1.0)), -15.0, max_relative = 1e-12);
        let corner = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 4.0], [0.0, 4.0]];
        let round = signed_area_m2(&rounded(&corner, 0.5));
        assert_relative_eq!(round, 12.0 - (5.0 - 1.0) * 0.0625, max_relative = 1e-12);
        assert_eq!(rounded(&circle(1.0, 12), 0.2).len(), 12);
    }
}
