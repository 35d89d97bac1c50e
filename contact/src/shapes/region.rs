//! The region of a plan: simple loops of the drawn size, their rounded corners, and distances to their sides.

use super::plan::Plan;
use crate::mesh::polygon::{Point, signed_area_m2};
use crate::mesh::span;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay as _;

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
        Self { from_m: a, along_m: d, end_y_m: b[1], inverse: 1.0 / square }
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
        let [[_, low_m], [_, high_m]] = span(loops.iter().flatten().copied());
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

// Rounded corners of an outline.

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
        let centre = [at[0] + (ux + vx) / length * reach_m, at[1] + (uy + vy) / length * reach_m];
        let start = [at[0] + ux * cut_m - centre[0], at[1] + uy * cut_m - centre[1]];
        // left turns of a loop are counter-clockwise arcs
        let sign = if uy * vx - ux * vy > 0.0 { 1.0 } else { -1.0 };
        let steps = (turn / step_rad).ceil();
        let mut k = 0.0;
        while k <= steps {
            let (s, c) = (sign * turn * k / steps).sin_cos();
            out.push([centre[0] + c * start[0] - s * start[1], centre[1] + s * start[0] + c * start[1]]);
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

// Turns the loops of a plan into simple loops of the drawn size.

/// Points of a union closer than this share of the extent are one: crossings leave sides of any shortness.
const SHORTEST_SIDE: f64 = 4e-3;
/// Holes of a union with less than this share of the extent squared are left out.
const LEAST_HOLE: f64 = 1e-3;
/// Pieces of a union with less than this share of the extent squared are left out.
const LEAST_PIECE: f64 = 0.02;

/// Simple loops, m, with the inside on their left: outlines counter-clockwise, holes clockwise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Region {
    pub(super) loops: Vec<Vec<Point>>,
    /// Length of the plan's unit, m.
    pub(super) unit_m: f64,
    /// Position of the plan's origin, m.
    pub(super) centre: Point,
}

impl Region {
    /// The footprint of `plan`, its larger extent `size_m` and its centroid at the origin. `None` if nothing is left.
    pub(super) fn of(plan: &Plan, size_m: f64) -> Option<Self> {
        let loops = if plan.overlapping {
            united(plan)
        } else {
            let outer = plan.add.iter().map(|l| directed(l.clone(), true));
            outer.chain(plan.cut.iter().map(|l| directed(l.clone(), false))).collect()
        };
        let mut region = Self { loops, unit_m: 1.0, centre: [0.0; 2] };
        region.fit(size_m)?;
        Some(region)
    }

    /// Scales to the larger extent `size_m` and moves the centroid to the origin.
    pub(super) fn fit(&mut self, size_m: f64) -> Option<()> {
        let [width, height] = self.extent_m();
        let scale = size_m / width.max(height);
        let (area, centre) = self.area_and_centroid();
        if !(scale.is_finite() && scale > 0.0 && area > 0.0) {
            return None;
        }
        for p in self.loops.iter_mut().flatten().chain([&mut self.centre]) {
            *p = [(p[0] - centre[0]) * scale, (p[1] - centre[1]) * scale];
        }
        self.unit_m *= scale;
        Some(())
    }

    /// Extent along x and y, m.
    pub(super) fn extent_m(&self) -> [f64; 2] {
        let [low, high] = span(self.loops.iter().flatten().copied());
        [0, 1].map(|k| (high[k] - low[k]).max(0.0))
    }

    /// Area of the footprint, m², and its centroid, m.
    pub(super) fn area_and_centroid(&self) -> (f64, Point) {
        let (mut area, mut moment) = (0.0, [0.0; 2]);
        for outline in &self.loops {
            let n = outline.len();
            for i in 0..n {
                let (a, b) = (outline[i], outline[(i + 1) % n]);
                let double = a[0] * b[1] - b[0] * a[1];
                area += 0.5 * double;
                for k in 0..2 {
                    moment[k] += double * (a[k] + b[k]) / 6.0;
                }
            }
        }
        (area, moment.map(|m| m / area))
    }

    /// Number of outlines and of holes.
    pub(super) fn parts_and_holes(&self) -> (u32, u32) {
        let count = |outline: bool| {
            let loops = self.loops.iter().filter(|l| (signed_area_m2(l) > 0.0) == outline);
            u32::try_from(loops.count()).unwrap_or(u32::MAX)
        };
        (count(true), count(false))
    }

    /// The loops with sides longer than `longest_m` cut into equal ones, and of every point of this region its place
    /// among all points of the new loops.
    pub(super) fn divided(&self, longest_m: f64) -> (Vec<Vec<Point>>, Vec<usize>) {
        let mut places = Vec::new();
        let mut base = 0;
        let divide = |outline: &Vec<Point>| {
            let mut out: Vec<Point> = Vec::with_capacity(2 * outline.len());
            for (i, &a) in outline.iter().enumerate() {
                let b = outline[(i + 1) % outline.len()];
                let length_m = ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
                let pieces = (length_m / longest_m).ceil().max(1.0);
                places.push(base + out.len());
                out.push(a);
                let mut k = 1.0;
                while k < pieces {
                    let t = k / pieces;
                    out.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
                    k += 1.0;
                }
            }
            base += out.len();
            out
        };
        (self.loops.iter().map(divide).collect(), places)
    }
}

/// `outline` in the given direction.
fn directed(mut outline: Vec<Point>, counter_clockwise: bool) -> Vec<Point> {
    if (signed_area_m2(&outline) > 0.0) != counter_clockwise {
        outline.reverse();
    }
    outline
}

/// Union of the added loops less the union of the cut ones, in the plan's unit, without short sides and small loops.
/// The boolean operation is exact on a grid of 2⁻³⁰ of the extent.
fn united(plan: &Plan) -> Vec<Vec<Point>> {
    let shapes = plan.add.overlay(&plan.cut, OverlayRule::Difference, FillRule::NonZero);
    let [low, high] = span(shapes.iter().flatten().flatten().copied());
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let mut loops = Vec::new();
    for shape in &shapes {
        for (i, outline) in shape.iter().enumerate() {
            let mut outline = outline.clone();
            merge_close(&mut outline, SHORTEST_SIDE * extent);
            let least = if i == 0 { LEAST_PIECE } else { LEAST_HOLE };
            let large = outline.len() > 2 && signed_area_m2(&outline).abs() > least * extent * extent;
            if !large && i == 0 {
                break;
            }
            if large {
                loops.push(directed(outline, i == 0));
            }
        }
    }
    loops
}

/// Leaves out points closer than `least` to the one kept before.
fn merge_close(outline: &mut Vec<Point>, least: f64) {
    let close = |a: Point, b: Point| (a[0] - b[0]).hypot(a[1] - b[1]) < least;
    outline.dedup_by(|b, a| close(*a, *b));
    while outline.len() > 1 && close(outline[0], outline[outline.len() - 1]) {
        outline.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{circle, placed, rectangle, signed_area_m2};
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
