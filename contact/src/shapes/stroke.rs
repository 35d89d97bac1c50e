//! Thick lines.

use crate::mesh::polygon::Point;

/// Longest tip of a mitred corner, in half widths; sharper corners are cut off.
const MITRE_LIMIT: f64 = 1.6;

/// Outline of a line along `path`, `width` wide, with mitred corners and straight ends. It overlaps itself where the
/// path crosses or closes, or where a side is shorter than the corners at its ends need: a union makes it simple.
pub(super) fn stroke(path: &[Point], width: f64) -> Vec<Point> {
    let half = 0.5 * width;
    let (mut left, mut right) = (Vec::with_capacity(path.len() + 4), Vec::with_capacity(path.len() + 4));
    let normals: Vec<Point> = path.windows(2).map(|ab| normal(ab[0], ab[1])).collect();
    for (i, &p) in path.iter().enumerate() {
        let before = normals[i.saturating_sub(1).min(normals.len() - 1)];
        let after = normals[i.min(normals.len() - 1)];
        let sum = [before[0] + after[0], before[1] + after[1]];
        let square = sum[0] * sum[0] + sum[1] * sum[1];
        // the mitre ends at p ± half · 2 sum / |sum|²
        let mitre = [0, 1].map(|k| 2.0 * half * sum[k] / square.max(0.04));
        let turn = before[0] * after[1] - before[1] * after[0];
        let cut = 2.0 / square.sqrt() > MITRE_LIMIT;
        let push = |side: &mut Vec<Point>, sign: f64| {
            let outer = sign * turn < 0.0;
            if cut && outer {
                side.extend([before, after].map(|n| [p[0] + sign * half * n[0], p[1] + sign * half * n[1]]));
            } else {
                side.push([p[0] + sign * mitre[0], p[1] + sign * mitre[1]]);
            }
        };
        push(&mut left, 1.0);
        push(&mut right, -1.0);
    }
    // right side forward, left side back: counter-clockwise
    left.reverse();
    right.extend(left);
    right
}

/// Points on an arc of an ellipse about `centre` with half axes `radii`, from `from_deg` to `to_deg` (degrees,
/// counter-clockwise from +x), in `steps`.
pub(super) fn arc(centre: Point, radii: Point, [from_deg, to_deg]: [f64; 2], steps: usize) -> Vec<Point> {
    (0..=steps)
        .map(|i| {
            let angle = from_deg + (to_deg - from_deg) * i as f64 / steps as f64;
            let (s, c) = angle.to_radians().sin_cos();
            [centre[0] + radii[0] * c, centre[1] + radii[1] * s]
        })
        .collect()
}

/// Unit normal of a → b, to its left.
fn normal(a: Point, b: Point) -> Point {
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = d[0].hypot(d[1]).max(f64::MIN_POSITIVE);
    [-d[1] / length, d[0] / length]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::signed_area_m2;
    use approx::assert_relative_eq;

    /// A right angle of two arms of length 4 along their middles, 2 wide: two arms of 4 × 2, of which the outer half of
    /// the corner is added and the inner half is shared.
    #[test]
    fn mitred_corner() {
        let corner = stroke(&[[4.0, 0.0], [0.0, 0.0], [0.0, 4.0]], 2.0);
        assert_eq!(corner.len(), 6);
        assert_relative_eq!(signed_area_m2(&corner), 16.0, max_relative = 1e-12);
    }
}
