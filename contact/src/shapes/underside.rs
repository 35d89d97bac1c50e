//! Points of an underside, and their heights before the relief is added.

use super::boundary::Bands;
use super::plan::Dome;
use super::triangulate::Plane;
use crate::mesh::polygon::Point;

/// The rounded lower edge is a quarter circle in two chords, or in one for small radii. Its middle is this share of the
/// radius inside the outline and as high: 1 − sin 45°.
const MIDDLE: f64 = 0.292_893_218_813_452_4;
/// Radius from which on the lower edge has the middle ring, m. Below, one chord is at most 0.3 mm from the arc.
const TWO_CHORDS_M: f64 = 1e-3;
/// How far a point may be closer to the outline than meant before it is left out: offsets of the two sides of a wedge
/// meet within it.
const CLOSENESS: f64 = 0.97;
/// Points inside closer than this share of the edge's radius are one: those of the arc around a corner fall together.
const SAME_POINT: f64 = 0.1;
/// Number of earlier points that a new one is compared with, far more than an arc has.
const COMPARED: usize = 48;
/// Least distance of the relief's points from the edge, in spacings.
const MARGIN: f64 = 0.35;
/// Largest step of a dome along its meridian, rad: a chord is 0.3 % of the radius from the arc.
const DOME_STEP_RAD: f64 = 0.16;

/// An underside as points in the plane and heights over them, m.
#[derive(Debug, Clone, Default)]
pub(super) struct Underside {
    pub(super) plane: Plane,
    pub(super) heights_m: Vec<f64>,
}

impl Underside {
    /// Flat inside `loops`, rising to `edge_m` over the last `edge_m` before the outline. Points for a relief are
    /// `spacing_m` apart, in a triangular lattice.
    pub(super) fn flat(loops: &[Vec<Point>], edge_m: f64, spacing_m: Option<f64>) -> Self {
        let plane = Plane::of(loops);
        let heights_m = vec![edge_m; plane.points.len()];
        let mut below = Self { plane, heights_m };
        if edge_m <= 0.0 && spacing_m.is_none() {
            return below;
        }
        let margin_m = spacing_m.map_or(0.0, |spacing_m| edge_m + MARGIN * spacing_m);
        let sides = Bands::of(loops, margin_m.max(edge_m));
        if edge_m > 0.0 {
            for outline in loops {
                below.round_edge(outline, &sides, edge_m);
            }
        }
        if let Some(spacing_m) = spacing_m {
            below.add_lattice(loops, &sides, margin_m, spacing_m);
        }
        below
    }

    /// Two rings of points inside `outline` for its rounded lower edge, the inner one with its creases. Where the
    /// region is too narrow for a ring it is left out.
    fn round_edge(&mut self, outline: &[Point], sides: &Bands, edge_m: f64) {
        let n = outline.len();
        let first_inside = self.plane.next.len();
        let mut ring: Vec<Option<usize>> = Vec::with_capacity(n);
        for (i, &at) in outline.iter().enumerate() {
            let axis = inward(outline[(i + n - 1) % n], at, outline[(i + 1) % n]);
            let offset = |d: f64| [at[0] + d * axis[0], at[1] + d * axis[1]];
            let (inner, middle) = (offset(edge_m), offset(MIDDLE * edge_m));
            let fits = sides.fits(inner, CLOSENESS * edge_m);
            // a ball that fits at the inner point leaves room for the one between it and the outline
            let wanted = edge_m >= TWO_CHORDS_M || !fits;
            if wanted && (fits || sides.fits(middle, CLOSENESS * MIDDLE * edge_m)) {
                self.add_apart(middle, MIDDLE * edge_m, SAME_POINT * edge_m, first_inside);
            }
            ring.push(fits.then(|| self.add_apart(inner, 0.0, SAME_POINT * edge_m, first_inside)));
        }
        for i in 0..n {
            if let (Some(a), Some(b)) = (ring[i], ring[(i + 1) % n])
                && a != b
            {
                self.plane.creases.push([a, b]);
            }
        }
    }

    /// A point inside, or the one that is there already among the last from index `first` on.
    fn add_apart(&mut self, at: Point, height_m: f64, least_m: f64, first: usize) -> usize {
        let near = |p: &Point| (p[0] - at[0]).abs() + (p[1] - at[1]).abs() < least_m;
        let first = first.max(self.plane.points.len().saturating_sub(COMPARED));
        if let Some(i) = self.plane.points[first..].iter().rposition(near) {
            return first + i;
        }
        self.plane.points.push(at);
        self.heights_m.push(height_m);
        self.plane.points.len() - 1
    }

    /// Points of a triangular lattice at least `margin_m` inside.
    fn add_lattice(&mut self, loops: &[Vec<Point>], sides: &Bands, margin_m: f64, spacing_m: f64) {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in loops.iter().flatten() {
            for k in 0..2 {
                low[k] = low[k].min(p[k] + margin_m);
                high[k] = high[k].max(p[k] - margin_m);
            }
        }
        let row_m = spacing_m * 0.75_f64.sqrt();
        let (mut y, mut odd) = (low[1], false);
        while y <= high[1] {
            let mut x = low[0] + if odd { 0.5 * spacing_m } else { 0.0 };
            while x <= high[0] {
                if sides.fits([x, y], margin_m) {
                    self.plane.points.push([x, y]);
                    self.heights_m.push(0.0);
                }
                x += spacing_m;
            }
            y += row_m;
            odd = !odd;
        }
    }

    /// `dome` under one `outline` that is star-shaped about `centre`, `width_m` wide: rings that are smaller copies of
    /// the outline, with fewer points towards the middle.
    pub(super) fn domed(outline: &[Point], centre: Point, width_m: f64, dome: &Dome) -> Self {
        let plane = Plane::of(&[outline.to_vec()]);
        let cap = dome.cap_rad.sin();
        let full = 1.0 - dome.cap_rad.cos();
        let rim_m = dome.rise * width_m;
        let mut below = Self {
            heights_m: vec![rim_m; plane.points.len()],
            plane,
        };
        let rings = (dome.cap_rad / DOME_STEP_RAD).ceil().max(3.0);
        let mut k = rings - 1.0;
        while k >= 0.0 {
            let angle = dome.cap_rad * k / rings;
            let share = dome.flat + (1.0 - dome.flat) * angle.sin() / cap;
            let height_m = rim_m * (1.0 - angle.cos()) / full;
            if share > 0.0 {
                let every = if share > 0.6 {
                    1
                } else if share > 0.25 {
                    2
                } else {
                    4
                };
                for p in outline.iter().step_by(every) {
                    let q = [0, 1].map(|a| centre[a] + share * (p[a] - centre[a]));
                    below.plane.points.push(q);
                    below.heights_m.push(height_m);
                }
            }
            k -= 1.0;
        }
        below.plane.points.push(centre);
        below.heights_m.push(0.0);
        below
    }
}

/// Step from the corner `at` to a point whose distance from both its sides is one, at most 3 long; inside is on the
/// left of before → at → after. At a reflex corner the step is one long.
fn inward(before: Point, at: Point, after: Point) -> Point {
    let normal = |a: Point, b: Point| {
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt().max(f64::MIN_POSITIVE);
        [-d[1] / length, d[0] / length]
    };
    let (m, n) = (normal(before, at), normal(at, after));
    let sum = [m[0] + n[0], m[1] + n[1]];
    let length = (sum[0] * sum[0] + sum[1] * sum[1]).sqrt().max(f64::MIN_POSITIVE);
    let convex = m[0] * n[1] - m[1] * n[0] > 0.0;
    // half the sum is the cosine of half the turn
    let step = if convex { (2.0 / length).min(3.0) } else { 1.0 };
    [sum[0] / length * step, sum[1] / length * step]
}
