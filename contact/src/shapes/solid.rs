//! The solid over a region: bow and waves of its underside, its triangles, its walls and its flat top.

use super::plan::{Dice, Dome};
use super::region::Bands;
use crate::mesh::polygon::Point;
use crate::mesh::{TriMesh, span};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::f64::consts::TAU;

/// Waves of a relief.
const WAVES: usize = 2;
/// Below this a relief is none, m: a hundredth of what a foam of 90 kPa over 6 mm feels under 1 kPa.
pub(super) const LEAST_RELIEF_M: f64 = 1e-6;

/// A smooth function of the place, in no unit: a bow along x and y and two waves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Relief {
    half_m: f64,
    bow: [f64; 2],
    /// Amplitude, phase in rad, and wave vector in rad per half extent.
    waves: [(f64, f64, Point); WAVES],
}

impl Relief {
    /// Of an object whose larger extent is `size_m`; waves are 0.7 to 2 times as long.
    pub(super) fn draw(dice: &mut Dice, size_m: f64) -> Self {
        let bow = [dice.between(-1.0, 1.0), dice.between(-1.0, 1.0)];
        let waves = [(); WAVES].map(|()| {
            let (s, c) = dice.angle_rad().sin_cos();
            let k = 0.5 * TAU / dice.between(0.7, 2.0);
            (dice.between(0.0, 0.45), dice.angle_rad(), [k * c, k * s])
        });
        Self { half_m: 0.5 * size_m, bow, waves }
    }

    /// Heights over `points`, m, whose lowest and highest differ by `relief_m`.
    pub(super) fn heights_m(&self, points: &[Point], relief_m: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = points.iter().map(|&p| self.at(p)).collect();
        let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &z| (l.min(z), h.max(z)));
        let scale = if high - low > 1e-9 { relief_m / (high - low) } else { 0.0 };
        for z in &mut heights {
            *z = (*z - low) * scale;
        }
        heights
    }

    fn at(&self, [x, y]: Point) -> f64 {
        let (x, y) = (x / self.half_m, y / self.half_m);
        let waves = self.waves.iter().map(|&(a, phase, k)| a * (phase + k[0] * x + k[1] * y).cos());
        self.bow[0] * x * x + self.bow[1] * y * y + waves.sum::<f64>()
    }
}

// Triangulates a region with points inside.

/// Points of loops, followed by points inside them, and the edges between points.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    pub(super) points: Vec<Point>,
    /// For every point of a loop, the next one; the inside is on the left.
    pub(super) next: Vec<usize>,
    /// Edges between inner points that the triangulation should have unless they cross others.
    pub(super) creases: Vec<[usize; 2]>,
}

/// Largest shift of a point while the triangles are sought, as a share of the extent.
const SHAKE: f64 = 1e-9;

impl Plane {
    /// The points of `loops`, and nothing inside yet.
    pub(super) fn of(loops: &[Vec<Point>]) -> Self {
        let mut plane = Self::default();
        for outline in loops {
            let (base, n) = (plane.points.len(), outline.len());
            plane.points.extend_from_slice(outline);
            plane.next.extend((0..n).map(|i| base + (i + 1) % n));
        }
        plane
    }

    /// The points, each shifted a little: regular figures have many points on one circle or line, for which the
    /// predicates of the triangulation would need exact arithmetic, at three times the cost of all else.
    fn shaken(&self) -> Vec<Point2<f64>> {
        let reach_m = self.points.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        // multiples of an irrational number, here in steps of 2⁻⁶⁴, are spread evenly over [−½, ½)
        let shift = |i: usize, step: u64| {
            let spread = (i as u64).wrapping_mul(step).cast_signed();
            SHAKE * reach_m * (spread as f64) * 0.5_f64.powi(64)
        };
        let shaken = self.points.iter().enumerate().map(|(i, p)| {
            let x = p[0] + shift(i, 0xc13f_a9a9_02a6_328f);
            Point2::new(x, p[1] + shift(i, 0x91e1_0da5_c79e_7b1d))
        });
        shaken.collect()
    }

    /// Counter-clockwise triangles over the inside, by a constrained Delaunay triangulation. `None` when loops touch or
    /// cross, or when two points coincide.
    pub(super) fn triangles(&self) -> Option<Vec<[usize; 3]>> {
        let points = self.shaken();
        let sides: Vec<[usize; 2]> = self.next.iter().enumerate().map(|(i, &j)| [i, j]).collect();
        let mut crossed = false;
        let mut net = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(points, sides, |_| {
            crossed = true;
        })
        .ok()?;
        if crossed || net.num_vertices() != self.points.len() {
            return None;
        }
        let vertex = FixedVertexHandle::from_index;
        for &[a, b] in &self.creases {
            net.try_add_constraint(vertex(a), vertex(b));
        }
        let is_side = |a: usize, b: usize| self.next.get(a) == Some(&b) || self.next.get(b) == Some(&a);
        let mut inside = vec![false; net.num_all_faces()];
        let (mut open, mut outside) = (Vec::new(), Vec::new());
        for (i, &j) in self.next.iter().enumerate() {
            let edge = net.get_edge_from_neighbors(vertex(i), vertex(j))?;
            open.push(edge.face().as_inner()?);
            outside.push(edge.rev().face().fix().index());
        }
        let mut triangles = Vec::with_capacity(2 * self.points.len());
        while let Some(face) = open.pop() {
            if std::mem::replace(&mut inside[face.fix().index()], true) {
                continue;
            }
            triangles.push(face.vertices().map(|v| v.fix().index()));
            for edge in face.adjacent_edges() {
                let [from, to] = edge.vertices().map(|v| v.fix().index());
                if !is_side(from, to) {
                    // the outer face lies beyond sides alone
                    open.push(edge.rev().face().as_inner()?);
                }
            }
        }
        let apart = outside.iter().all(|&face| !inside[face]);
        apart.then_some(triangles)
    }
}

// Points of an underside, and their heights before the relief is added.

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
        let [low, high] = span(loops.iter().flatten().copied());
        let (low, high) = (low.map(|x| x + margin_m), high.map(|x| x - margin_m));
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
        let mut below = Self { heights_m: vec![rim_m; plane.points.len()], plane };
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

// The closed solid over an underside.

/// Height of the flat top over the highest point of the underside, m. Not visible to the skin.
const THICKNESS_M: f64 = 10e-3;
/// Least area of a triangle of a wall's fan, as a share of that of a level one.
const LEAST_FAN: f64 = 0.1;

/// Prism over `loops` with a flat top and the underside `below`, which `relief` of the height `relief_m` is added to.
/// The underside's loops are the same ones, some sides divided; `places` has the places of their common points. Its
/// lowest point is at z = 0. `None` when loops touch or cross.
pub(super) fn solid(
    loops: &[Vec<Point>],
    below: &Underside,
    places: &[usize],
    relief: Option<(&Relief, f64)>,
) -> Option<TriMesh> {
    let points = &below.plane.points;
    let mut heights_m = below.heights_m.clone();
    if let Some((relief, relief_m)) = relief {
        for (z, bump_m) in heights_m.iter_mut().zip(relief.heights_m(points, relief_m)) {
            *z += bump_m;
        }
    }
    let low = heights_m.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let top_m = high - low + THICKNESS_M;
    let mut lid = Plane::of(loops);
    let mut places = places.to_vec();
    if !fans_are_sound(&lid, &places, below, &heights_m, top_m + low) {
        let sides = below.plane.next.len();
        (lid.points, lid.next) = (points[..sides].to_vec(), below.plane.next.clone());
        places = (0..sides).collect();
    }
    let (under, over) = (below.plane.triangles()?, lid.triangles()?);
    let base = points.len();
    let index = |i: usize| u32::try_from(i).ok();
    let mut mesh = TriMesh::default();
    mesh.vertices.reserve(base + lid.points.len());
    mesh.vertices.extend(points.iter().zip(&heights_m).map(|(p, z)| [p[0], p[1], z - low]));
    mesh.vertices.extend(lid.points.iter().map(|p| [p[0], p[1], top_m]));
    mesh.triangles.reserve(under.len() + over.len() + 2 * lid.points.len());
    for [a, b, c] in under {
        mesh.triangles.push([index(a)?, index(c)?, index(b)?]);
    }
    for t in over {
        let [a, b, c] = t.map(|i| index(base + i));
        mesh.triangles.push([a?, b?, c?]);
    }
    for (i, (&j, &place)) in lid.next.iter().zip(&places).enumerate() {
        // a fan from the upper corner over the pieces of the side, and the rest of the wall
        let (mut low, end) = (place, places[j]);
        while low != end {
            let next = below.plane.next[low];
            mesh.triangles.push([index(low)?, index(next)?, index(base + i)?]);
            low = next;
        }
        mesh.triangles.push([index(end)?, index(base + j)?, index(base + i)?]);
    }
    Some(mesh)
}

/// Whether every side's wall can be a fan about the upper corner at its beginning: seen from there, its lower points
/// come one after the other. Those of a steep relief may not.
fn fans_are_sound(lid: &Plane, places: &[usize], below: &Underside, heights_m: &[f64], top_m: f64) -> bool {
    lid.next.iter().zip(places).enumerate().all(|(i, (&j, &place))| {
        let corner = lid.points[i];
        // distance from the corner along the side, and drop below it
        let seen = |k: usize| {
            let p = below.plane.points[k];
            let along_m = ((p[0] - corner[0]).powi(2) + (p[1] - corner[1]).powi(2)).sqrt();
            (along_m, top_m - heights_m[k])
        };
        let (mut low, end) = (place, places[j]);
        while low != end {
            let next = below.plane.next[low];
            let ((near, near_drop), (far, far_drop)) = (seen(low), seen(next));
            if far * near_drop - near * far_drop < LEAST_FAN * (far - near) * THICKNESS_M {
                return false;
            }
            low = next;
        }
        true
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{circle, rectangle};

    /// n points on h + 1 loops and m inside give n + 2 m + 2 h − 2 triangles.
    #[test]
    fn tiles_a_ring_and_refuses_loops_that_cross() {
        let mut hole = circle(1.0, 12);
        hole.reverse();
        let mut plane = Plane::of(&[rectangle(6.0, 4.0), hole]);
        plane.points.extend([[2.0, 0.5], [2.0, -0.5]]);
        plane.creases.push([16, 17]);
        assert_eq!(plane.triangles().unwrap().len(), 16 + 4 + 2 - 2);
        let crossed = Plane::of(&[vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]]);
        assert!(crossed.triangles().is_none());
    }
}
