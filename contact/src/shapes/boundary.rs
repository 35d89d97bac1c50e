//! Distance to the sides of a region.

use crate::mesh::polygon::Point;

/// One side of a loop.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Side {
    from_m: Point,
    along_m: Point,
    /// y of the end, m. Because it is a sum, it may differ from the start of the next side; a point in between would be
    /// outside.
    end_y_m: f64,
    /// 1 / length², 1/m².
    inverse: f64,
}

impl Side {
    fn new(a: Point, b: Point) -> Self {
        let d = [b[0] - a[0], b[1] - a[1]];
        let square = (d[0] * d[0] + d[1] * d[1]).max(f64::MIN_POSITIVE);
        Self {
            from_m: a,
            along_m: d,
            end_y_m: b[1],
            inverse: 1.0 / square,
        }
    }

    /// Lower and upper end along y, m.
    fn span_m(&self) -> [f64; 2] {
        let (a, b) = (self.from_m[1], self.end_y_m);
        [a.min(b), a.max(b)]
    }
}

/// The sides of `loops`, in order.
pub(super) fn sides(loops: &[Vec<Point>]) -> impl Iterator<Item = Side> + '_ {
    loops.iter().flat_map(|outline| {
        let after = outline.iter().cycle().skip(1);
        outline.iter().zip(after).map(|(&a, &b)| Side::new(a, b))
    })
}

/// Distance of `at` from the nearest of `sides`, m; negative outside.
pub(super) fn depth_m(sides: &[Side], [x, y]: Point) -> f64 {
    let (mut nearest, mut crossings) = (f64::INFINITY, 0_u32);
    for side in sides {
        let (px, py) = (x - side.from_m[0], y - side.from_m[1]);
        let [dx, dy] = side.along_m;
        let t = (px * dx + py * dy) * side.inverse;
        let t = if t > 0.0 { t } else { 0.0 };
        let t = if t < 1.0 { t } else { 1.0 };
        let (ex, ey) = (px - t * dx, py - t * dy);
        let square = ex * ex + ey * ey;
        nearest = if square < nearest { square } else { nearest };
        let spans = (y < side.from_m[1]) != (y < side.end_y_m);
        // left of the side where it crosses the height of the point
        let left = (px * dy < py * dx) == (dy > 0.0);
        crossings += u32::from(spans & left);
    }
    let distance_m = nearest.sqrt();
    if crossings % 2 == 1 { distance_m } else { -distance_m }
}

/// Number of bands; with more, a side is in several.
const BANDS: usize = 16;

/// The sides of a region in horizontal bands, so that a question about a place asks the sides near its height alone.
#[derive(Debug, Clone)]
pub(super) struct Bands {
    low_m: f64,
    height_m: f64,
    /// Sides, band by band; `ends[b]..ends[b + 1]` are those of band b.
    sides: Vec<Side>,
    ends: [usize; BANDS + 1],
}

impl Bands {
    /// For questions about distances up to `reach_m`.
    pub(super) fn of(loops: &[Vec<Point>], reach_m: f64) -> Self {
        let along = || loops.iter().flatten().map(|p| p[1]);
        let (low_m, high_m) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        let mut bands = Self {
            low_m,
            height_m: ((high_m - low_m) / BANDS as f64).max(f64::MIN_POSITIVE),
            sides: Vec::new(),
            ends: [0; BANDS + 1],
        };
        let of_side = |bands: &Self, side: &Side| {
            let [low_m, high_m] = side.span_m();
            bands.band(low_m - reach_m)..=bands.band(high_m + reach_m)
        };
        let mut counts = [0; BANDS];
        for side in sides(loops) {
            of_side(&bands, &side).for_each(|b| counts[b] += 1);
        }
        for (b, count) in counts.into_iter().enumerate() {
            bands.ends[b + 1] = bands.ends[b] + count;
        }
        bands.sides = vec![Side::default(); bands.ends[BANDS]];
        let mut next = bands.ends;
        for side in sides(loops) {
            for b in of_side(&bands, &side) {
                bands.sides[next[b]] = side;
                next[b] += 1;
            }
        }
        bands
    }

    /// Whether a disc of `radius_m`, at most the reach, about `at` lies inside.
    pub(super) fn fits(&self, at: Point, radius_m: f64) -> bool {
        let band = self.band(at[1]);
        depth_m(&self.sides[self.ends[band]..self.ends[band + 1]], at) >= radius_m
    }

    #[expect(clippy::cast_possible_truncation, reason = "float-to-int casts saturate")]
    fn band(&self, y: f64) -> usize {
        let nth = (y - self.low_m) / self.height_m;
        if nth > 0.0 { (nth as usize).min(BANDS - 1) } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{placed, rectangle};
    use approx::assert_relative_eq;

    #[test]
    fn depths_beside_sides_corners_and_holes() {
        let mut hole = placed(&rectangle(1.0, 1.0), 0.0, [1.0, 0.0]);
        hole.reverse();
        let loops = [rectangle(6.0, 4.0), hole];
        let sides: Vec<Side> = sides(&loops).collect();
        let bands = Bands::of(&loops, 0.5);
        let cases = [
            ([0.0, 1.9], 0.1),
            ([0.0, 0.0], 0.5),
            ([1.0, 0.1], -0.4),
            ([4.0, 3.0], -(2.0_f64.sqrt())),
            ([-2.5, -1.9], 0.1),
            ([2.0, 1.0], 0.5_f64.sqrt()),
        ];
        for (at, depth) in cases {
            assert_relative_eq!(depth_m(&sides, at), depth, max_relative = 1e-12);
            assert_eq!(bands.fits(at, 0.45), depth > 0.45, "{at:?}");
        }
    }

    /// A height just below a corner counts one crossing, though it is lost beside the height of the side's other end.
    #[test]
    fn a_height_that_rounds_to_a_corner_is_inside() {
        let diamond = [vec![[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]];
        let sides: Vec<Side> = sides(&diamond).collect();
        for y in [-1e-19, 0.0, 1e-19] {
            assert_relative_eq!(depth_m(&sides, [-0.5, y]), 0.125_f64.sqrt(), max_relative = 1e-12);
        }
    }
}
