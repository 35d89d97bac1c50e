//! Rays and what they meet: meshes, and shapes whose chords have a closed form.

use crate::field::PosedMesh;
use crate::mesh::TriMesh;
use multiversion::multiversion;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhLeafCost};
use parry3d_f64::query::PointQuery as _;
use std::ops::Range;
use std::sync::Arc;

/// Share of a triangle by which rays beside it count as hits, so that none passes between two triangles.
const SLACK: f64 = 1e-9;

/// Triangles seen under a smaller sine than this are passed over: the faces beside them are met.
const EDGE_ON: f64 = 1e-9;

/// A body as columns of foam see it, in its own axes: a mesh, or convex parts.
#[derive(Debug, Clone)]
pub struct Solid {
    form: Arc<Form>,
    /// Lower and upper corner of the box around it, m.
    low_m: Vector,
    high_m: Vector,
}

#[derive(Debug, Clone)]
enum Form {
    Mesh(Mesh),
    Parts(Vec<Part>),
}

/// The triangles of a mesh in a hierarchy of bounding boxes.
#[derive(Debug, Clone)]
struct Mesh {
    triangles: Vec<Triangle>,
    boxes: Bvh,
    /// Whether the mesh is closed and its triangles face outwards, so that it has an inside.
    closed: bool,
}

/// First corner, the two edges from it, and the product of their lengths.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    corner_m: Vector,
    edges_m: [Vector; 2],
    size_m2: f64,
}

/// Where a ray meets a mesh first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    /// Distance from the start of the ray, m.
    pub(super) distance_m: f64,
    /// Whether the ray enters the body there, judged by the order of the triangle's corners.
    enters: bool,
}

impl BvhLeafCost for Hit {
    fn cost(&self) -> f64 {
        self.distance_m
    }
}

/// A convex shape around the origin of its axes, whose chords have a closed form. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// Half axes along x, y and z; a ball has three that are equal.
    Ellipsoid([f64; 3]),
    /// Half sides along x, y and z.
    Cuboid([f64; 3]),
    /// Radius, and half the length along z.
    Cylinder(f64, f64),
    /// Radius, and half the length along z without the round ends.
    Capsule(f64, f64),
    /// All with z below 0.
    HalfSpace,
}

/// A convex part of a body, and where it is in the body's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Its shape.
    pub shape: Primitive,
    /// Rotation matrix, row-major: body = R · part + position.
    pub rotation: [[f64; 3]; 3],
    /// Position of its origin, m.
    pub position_m: [f64; 3],
}

impl Primitive {
    /// Where the line p + t d enters and leaves the shape; `None` beside it. `d` has the length 1.
    #[inline]
    fn chord(&self, p: Vector, d: Vector) -> Option<[f64; 2]> {
        let ends = match *self {
            Self::Ellipsoid(half_m) => ellipsoid(Vector::from(half_m).recip(), p, d),
            Self::Cuboid(half_m) => cuboid(half_m, p, d),
            Self::Cylinder(radius_m, half_m) => cylinder(radius_m, half_m, p, d),
            Self::Capsule(radius_m, half_m) => capsule(radius_m, half_m, p, d),
            Self::HalfSpace => half_space(p, d),
        };
        (ends[0] < ends[1]).then_some(ends)
    }

    /// A distance, m, from which a place is at least away from it; negative inside.
    #[inline]
    fn away_m(&self, p: Vector) -> f64 {
        let beside = |p: Vector, half: Vector| (p.abs() - half).max(Vector::ZERO);
        match *self {
            // in units of the half axes no distance shrinks by more than the least of them
            Self::Ellipsoid([x, y, z]) => ((p / Vector::new(x, y, z)).length() - 1.0) * x.min(y).min(z),
            Self::Cuboid(half_m) => beside(p, Vector::from(half_m)).length(),
            Self::Cylinder(radius_m, half_m) => {
                let across = p.x.hypot(p.y);
                beside(Vector::new(across, 0.0, p.z), Vector::new(radius_m, 0.0, half_m)).length()
            }
            Self::Capsule(radius_m, half_m) => beside(p, Vector::new(0.0, 0.0, half_m)).length() - radius_m,
            Self::HalfSpace => p.z,
        }
    }

    /// Half the sides of the box around it, m.
    fn reach_m(&self) -> Vector {
        match *self {
            Self::Ellipsoid(half_m) | Self::Cuboid(half_m) => Vector::from(half_m),
            Self::Cylinder(radius_m, half_m) => Vector::new(radius_m, radius_m, half_m),
            Self::Capsule(radius_m, half_m) => Vector::new(radius_m, radius_m, half_m + radius_m),
            Self::HalfSpace => Vector::splat(f64::INFINITY),
        }
    }
}

const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const NOWHERE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

// Where lines p + t d enter and leave shapes: the first end is not before the second where they miss. Without branches:
// many lines become vector instructions.

#[inline(always)]
fn less(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn more(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn select(is: bool, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [if is { a[0] } else { b[0] }, if is { a[1] } else { b[1] }]
}

#[inline(always)]
fn both(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [more(a[0], b[0]), less(a[1], b[1])]
}

/// Of chords of a convex shape that hang together, or miss.
#[inline(always)]
fn either(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [less(a[0], b[0]), more(a[1], b[1])]
}

/// The roots of a t² + 2 b t + c = 0 in their order, for a > 0.
#[inline(always)]
fn quadratic(a: f64, b: f64, c: f64) -> [f64; 2] {
    let discriminant = b * b - a * c;
    // without cancellation
    let q = -b - more(discriminant, 0.0).sqrt().copysign(b);
    let (one, other) = (q / a, c / q);
    select(discriminant > 0.0, [less(one, other), more(one, other)], NOWHERE)
}

/// The line inside an endless cylinder about z.
#[inline(always)]
fn round(p: Vector, d: Vector, radius_m: f64) -> [f64; 2] {
    let (a, c) = (d.x * d.x + d.y * d.y, p.x * p.x + p.y * p.y - radius_m * radius_m);
    let along = select(c < 0.0, EVERYWHERE, NOWHERE);
    select(a < 1e-24, along, quadratic(more(a, 1e-24), p.x * d.x + p.y * d.y, c))
}

/// Where a coordinate p + t d lies within ± half.
#[inline(always)]
fn slab(p: f64, d: f64, half_m: f64) -> [f64; 2] {
    let along = select(p.abs() < half_m, EVERYWHERE, NOWHERE);
    let (a, b) = ((-half_m - p) / d, (half_m - p) / d);
    select(d == 0.0, along, [less(a, b), more(a, b)])
}

#[inline(always)]
fn ellipsoid(inverse: Vector, p: Vector, d: Vector) -> [f64; 2] {
    let (p, d) = (p * inverse, d * inverse);
    quadratic(d.length_squared(), p.dot(d), p.length_squared() - 1.0)
}

#[inline(always)]
fn cuboid([x, y, z]: [f64; 3], p: Vector, d: Vector) -> [f64; 2] {
    both(both(slab(p.x, d.x, x), slab(p.y, d.y, y)), slab(p.z, d.z, z))
}

#[inline(always)]
fn cylinder(radius_m: f64, half_m: f64, p: Vector, d: Vector) -> [f64; 2] {
    both(round(p, d, radius_m), slab(p.z, d.z, half_m))
}

#[inline(always)]
fn capsule(radius_m: f64, half_m: f64, p: Vector, d: Vector) -> [f64; 2] {
    let ball = |z: f64| {
        let p = Vector::new(p.x, p.y, p.z - z);
        quadratic(1.0, p.dot(d), p.length_squared() - radius_m * radius_m)
    };
    let wall = cylinder(radius_m, half_m, p, d);
    let wall = select(wall[0] < wall[1], wall, NOWHERE);
    either(wall, either(ball(half_m), ball(-half_m)))
}

#[inline(always)]
fn half_space(p: Vector, d: Vector) -> [f64; 2] {
    let at = -p.z / d.z;
    let along = select(p.z < 0.0, EVERYWHERE, NOWHERE);
    select(d.z > 0.0, [f64::NEG_INFINITY, at], select(d.z < 0.0, [at, f64::INFINITY], along))
}

/// How deep a convex shape whose chord is `ends` reaches into a column: [`Standing::front_m`] of one part; −∞ where
/// there is nothing.
#[inline(always)]
fn front([enter, leave]: [f64; 2], thickness_m: f64, reach_m: f64) -> f64 {
    let (inward_m, there) = (-enter, enter < leave);
    let through = thickness_m + less(inward_m, thickness_m);
    let around = there && enter < f64::MIN_POSITIVE && leave > -f64::MIN_POSITIVE;
    let before = there && enter >= f64::MIN_POSITIVE && enter <= reach_m;
    let inside = if leave > 0.0 && inward_m < leave { through } else { f64::NEG_INFINITY };
    if around { inside } else { if before { thickness_m - enter } else { f64::NEG_INFINITY } }
}

/// Columns of foam, as lines: their bases, m, and directions, coordinate by coordinate.
#[derive(Debug, Clone, Default)]
pub(super) struct Beams {
    base_m: [Vec<f64>; 3],
    outward: [Vec<f64>; 3],
}

impl Beams {
    pub(super) fn clear(&mut self) {
        self.base_m.iter_mut().chain(&mut self.outward).for_each(Vec::clear);
    }

    pub(super) fn push(&mut self, base_m: Vector, outward: Vector) {
        self.base_m.iter_mut().zip(base_m.to_array()).for_each(|(all, v)| all.push(v));
        self.outward.iter_mut().zip(outward.to_array()).for_each(|(all, v)| all.push(v));
    }

    fn len(&self) -> usize {
        self.base_m[0].len()
    }

    /// Base, m, and direction of column `k`.
    fn at(&self, k: usize) -> [Vector; 2] {
        [&self.base_m, &self.outward].map(|v| Vector::new(v[0][k], v[1][k], v[2][k]))
    }
}

/// Neighbouring columns, and what they may meet of a mesh.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// At most [`LANES`].
    lanes: Range<usize>,
    /// Numbers of its triangles, if they are few enough to be tried one by one.
    triangles: Option<Vec<u32>>,
    /// Whether all bases are outside the mesh, which is closed.
    outside: bool,
}

/// Columns of a group.
pub(super) const LANES: usize = 8;
/// Most triangles of a group.
const MANY: usize = 48;

/// Distance, m, at which each of the beams from `first` on first meets one of `triangles`, which are in the axes of a
/// body, and whether it enters there (1) or leaves (-1). Infinity where there is none, and past the last beam.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn hits(
    all: &[Triangle],
    triangles: &[u32],
    beams: &Beams,
    first: usize,
    (axes, origin_m): (&[Vector; 3], Vector),
) -> [[f64; LANES]; 2] {
    let lanes = |values: &[f64]| -> [f64; LANES] {
        std::array::from_fn(|l| values.get(first + l).copied().unwrap_or(f64::NAN))
    };
    let [bx, by, bz] = [0, 1, 2].map(|k| lanes(&beams.base_m[k]));
    let [ax, ay, az] = [0, 1, 2].map(|k| lanes(&beams.outward[k]));
    let (mut starts, mut ways) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    for l in 0..LANES {
        let start = into(axes, Vector::new(bx[l], by[l], bz[l]) - origin_m);
        let way = into(axes, Vector::new(ax[l], ay[l], az[l]));
        (starts[0][l], starts[1][l], starts[2][l]) = (start.x, start.y, start.z);
        (ways[0][l], ways[1][l], ways[2][l]) = (way.x, way.y, way.z);
    }
    let (mut nearest_m, mut enters) = ([f64::INFINITY; LANES], [0.0; LANES]);
    for triangle in triangles.iter().map(|k| &all[*k as usize]) {
        for l in 0..LANES {
            let start_m = Vector::new(starts[0][l], starts[1][l], starts[2][l]);
            let (distance_m, determinant) = triangle.meets(start_m, Vector::new(ways[0][l], ways[1][l], ways[2][l]));
            let nearer = distance_m < nearest_m[l];
            nearest_m[l] = if nearer { distance_m } else { nearest_m[l] };
            enters[l] = if nearer { determinant } else { enters[l] };
        }
    }
    [nearest_m, enters]
}

/// [`front`] of one part for all `beams`, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn fronts(part: &StandingPart, beams: &Beams, [thickness_m, reach_m]: [f64; 2], out: &mut [f64]) {
    let StandingPart { shape, axes, origin_m, .. } = part;
    match *shape {
        Primitive::Ellipsoid(half_m) => {
            let inverse = Vector::from(half_m).recip();
            fronts_of(axes, *origin_m, beams, [thickness_m, reach_m], out, |p, d| ellipsoid(inverse, p, d));
        }
        Primitive::Cuboid(half_m) => {
            fronts_of(axes, *origin_m, beams, [thickness_m, reach_m], out, |p, d| cuboid(half_m, p, d));
        }
        Primitive::Cylinder(r, half_m) => {
            fronts_of(axes, *origin_m, beams, [thickness_m, reach_m], out, |p, d| cylinder(r, half_m, p, d));
        }
        Primitive::Capsule(r, half_m) => {
            fronts_of(axes, *origin_m, beams, [thickness_m, reach_m], out, |p, d| capsule(r, half_m, p, d));
        }
        Primitive::HalfSpace => fronts_of(axes, *origin_m, beams, [thickness_m, reach_m], out, half_space),
    }
}

#[inline(always)]
fn fronts_of(
    axes: &[Vector; 3],
    origin_m: Vector,
    beams: &Beams,
    [thickness_m, reach_m]: [f64; 2],
    out: &mut [f64],
    ends: impl Fn(Vector, Vector) -> [f64; 2],
) {
    let count = out.len();
    let [x, y, z] = [0, 1, 2].map(|k| &beams.base_m[k][..count]);
    let [a, b, c] = [0, 1, 2].map(|k| &beams.outward[k][..count]);
    for k in 0..count {
        let p = into(axes, Vector::new(x[k], y[k], z[k]) - origin_m);
        out[k] = front(ends(p, into(axes, Vector::new(a[k], b[k], c[k]))), thickness_m, reach_m);
    }
}

/// A solid where a body is.
#[derive(Debug)]
pub(crate) struct Standing<'a> {
    solid: &'a Solid,
    axes: [Vector; 3],
    origin_m: Vector,
    /// Its parts where they are.
    parts: Vec<StandingPart>,
}

/// A part where it is.
#[derive(Debug)]
pub(crate) struct StandingPart {
    shape: Primitive,
    /// Columns of its rotation's inverse.
    axes: [Vector; 3],
    origin_m: Vector,
    /// Half the sides of the box around it.
    half_m: Vector,
}

impl StandingPart {
    /// Height of its lowest point on the vertical line through a place (x, y), m; infinite beside it.
    #[inline]
    pub(crate) fn lowest_m(&self, [x, y]: [f64; 2]) -> f64 {
        let start = into(&self.axes, Vector::new(x, y, 0.0) - self.origin_m);
        self.shape.chord(start, self.axes[2]).map_or(f64::INFINITY, |[enter, _]| enter)
    }

    /// Lowest and highest (x, y) of a box, which may be too large, around what of it is below z = 0, m; `None` if
    /// nothing is.
    pub(crate) fn below_m(&self) -> Option<[[f64; 2]; 2]> {
        if self.origin_m.z >= self.axes[2].abs().dot(self.half_m) {
            return None;
        }
        let mut reach = [0, 1].map(|k| self.axes[k].abs().dot(self.half_m));
        if let Primitive::Ellipsoid([a, b, c]) = self.shape
            && a.max(b).max(c) <= a.min(b).min(c)
            && self.origin_m.z > 0.0
        {
            reach = [(a * a - self.origin_m.z * self.origin_m.z).max(0.0).sqrt(); 2];
        }
        let at = [self.origin_m.x, self.origin_m.y];
        Some([[at[0] - reach[0], at[1] - reach[1]], [at[0] + reach[0], at[1] + reach[1]]])
    }
}

impl Standing<'_> {
    pub(super) fn solid(&self) -> &Solid {
        self.solid
    }

    /// Its parts; none of a mesh.
    pub(crate) fn parts(&self) -> &[StandingPart] {
        &self.parts
    }

    /// Whether all of it is ellipsoids and capsules, with radii of curvature of at least `radius_m`.
    pub(crate) fn is_smooth(&self, radius_m: f64) -> bool {
        let smooth = |part: &StandingPart| match part.shape {
            Primitive::Ellipsoid([a, b, c]) => a.min(b).min(c).powi(2) >= radius_m * a.max(b).max(c),
            Primitive::Capsule(own_m, _) => own_m >= radius_m,
            Primitive::Cuboid(_) | Primitive::Cylinder(..) | Primitive::HalfSpace => false,
        };
        !self.parts.is_empty() && self.parts.iter().all(smooth)
    }

    /// How deep the solid reaches into a column of foam, from its free surface, m, or, as a negative depth, the gap to
    /// a solid up to `gap_m` above the surface; `None` where there is nothing.
    ///
    /// The column starts at `base_m`, on the link, and goes `thickness_m` along `outward` (length 1) to the free
    /// surface. A solid with the base inside has come through the whole column if more of it lies outward of the base
    /// than inward, along the column's line: its depth is then the thickness, and how far it goes on behind the base,
    /// at most another thickness. Otherwise it has come from behind, and does not touch the foam.
    #[inline]
    pub(crate) fn front_m(&self, base_m: Vector, outward: Vector, thickness_m: f64, gap_m: f64) -> Option<f64> {
        match &*self.solid.form {
            Form::Parts(_) => self.front_of_parts(base_m, outward, thickness_m, gap_m),
            Form::Mesh(mesh) => {
                let (base_m, outward) = (into(&self.axes, base_m - self.origin_m), into(&self.axes, outward));
                let beside = base_m.cmplt(self.solid.low_m).any() || base_m.cmpgt(self.solid.high_m).any();
                mesh.front_m(base_m, outward, thickness_m, gap_m, beside)
            }
        }
    }

    /// As [`Standing::front_m`] without a gap; 0 where the solid does not touch the column.
    #[inline]
    pub(crate) fn depth_m(&self, base_m: Vector, outward: Vector, thickness_m: f64) -> f64 {
        self.front_m(base_m, outward, thickness_m, 0.0).unwrap_or(0.0)
    }

    /// [`front_m`](Self::front_m) of all `beams`; −∞ where there is nothing. `near` is what
    /// [`Standing::look`] found for each of their groups, not too far from here.
    pub(super) fn fronts_m(&self, beams: &Beams, near: &[Group], thickness_m: f64, gap_m: f64, out: &mut Vec<f64>) {
        out.clear();
        out.resize(beams.len(), f64::NEG_INFINITY);
        let reach_m = thickness_m + gap_m;
        let ray = |k: usize| {
            let [base_m, outward] = beams.at(k);
            self.front_m(base_m, outward, thickness_m, gap_m).unwrap_or(f64::NEG_INFINITY)
        };
        match (&*self.solid.form, &self.parts[..]) {
            (Form::Parts(_), [part]) => fronts(part, beams, [thickness_m, reach_m], out),
            (Form::Parts(_), _) => out.iter_mut().enumerate().for_each(|(k, out)| *out = ray(k)),
            (Form::Mesh(mesh), _) => {
                for group in near {
                    let lanes = group.lanes.clone();
                    let Some(triangles) = &group.triangles else {
                        lanes.for_each(|k| out[k] = ray(k));
                        continue;
                    };
                    let own = (&self.axes, self.origin_m);
                    let [hits_m, enters] = hits(&mesh.triangles, triangles, beams, lanes.start, own);
                    for (l, k) in lanes.enumerate() {
                        if hits_m[l] < reach_m && (enters[l] > 0.0 || !mesh.closed) {
                            out[k] = thickness_m - hits_m[l];
                        } else if hits_m[l] < reach_m || !group.outside {
                            out[k] = ray(k);
                        }
                    }
                }
            }
        }
    }

    /// What columns `lanes` meet while the body moves by less than `margin_m`: all have their points within `radius_m`
    /// of `centre_m` and their bases as far from `base_m`, and reach within `reach_m` of their points.
    pub(super) fn look(
        &self,
        lanes: Range<usize>,
        [centre_m, base_m]: [Vector; 2],
        radius_m: f64,
        [reach_m, margin_m]: [f64; 2],
    ) -> Group {
        let mut group = Group { lanes, triangles: None, outside: false };
        if let Form::Mesh(mesh) = &*self.solid.form {
            let [centre_m, base_m] = [centre_m, base_m].map(|at| into(&self.axes, at - self.origin_m));
            let around = |at: Vector, reach_m: f64| Aabb::new(at - reach_m, at + reach_m);
            let found = around(centre_m, radius_m + reach_m);
            let found: Vec<u32> = mesh.boxes.intersect_aabb(&found).take(MANY + 1).collect();
            group.triangles = Some(found).filter(|found| found.len() <= MANY);
            let clear = mesh.boxes.intersect_aabb(&around(base_m, radius_m + margin_m)).next().is_none();
            group.outside = mesh.closed && clear && !mesh.holds(base_m);
        }
        group
    }

    /// From the chords of the parts.
    #[inline]
    fn front_of_parts(&self, base_m: Vector, outward: Vector, thickness_m: f64, gap_m: f64) -> Option<f64> {
        let reach_m = thickness_m + gap_m;
        let (mut inside, mut first_m) = ([0.0_f64; 2], f64::INFINITY);
        // chords that hang together with the base's, and the first beyond it
        let mut pending = true;
        while pending {
            pending = false;
            first_m = f64::INFINITY;
            for StandingPart { shape, axes, origin_m, .. } in &self.parts {
                let base_m = into(axes, base_m - *origin_m);
                if shape.away_m(base_m) > reach_m {
                    continue;
                }
                let Some([enter, leave]) = shape.chord(base_m, into(axes, outward)) else { continue };
                if enter < inside[1].max(f64::MIN_POSITIVE) && leave > inside[0].min(-f64::MIN_POSITIVE) {
                    pending |= self.parts.len() > 1 && (enter < inside[0] || leave > inside[1]);
                    inside = [inside[0].min(enter), inside[1].max(leave)];
                } else if enter >= inside[1] && enter < first_m {
                    first_m = enter;
                }
            }
        }
        let [inward_m, outward_m] = [-inside[0], inside[1]];
        if outward_m > 0.0 && inward_m < outward_m {
            return Some(thickness_m + inward_m.min(thickness_m));
        }
        (first_m <= reach_m).then_some(thickness_m - first_m)
    }

    /// Whether all of the body is farther than `reach_m` from what is both in a ball and in a box around `centre_m`;
    /// some bodies that are may not be told. All lengths in m.
    pub(crate) fn is_far(&self, centre_m: Vector, radius_m: f64, half_m: Vector, reach_m: f64) -> bool {
        let is_beside = |[x, y, z]: &[Vector; 3], at: Vector, [low_m, high_m]: [Vector; 2]| {
            let beside_m = (low_m - at).max(at - high_m) - reach_m;
            let reach = || x.abs() * half_m.x + y.abs() * half_m.y + z.abs() * half_m.z;
            beside_m.max_element() > 0.0 && (beside_m.max_element() > radius_m || beside_m.cmpgt(reach()).any())
        };
        match &*self.solid.form {
            Form::Parts(_) => self.parts.iter().all(|StandingPart { shape, axes, origin_m, half_m: half }| {
                let away = centre_m - *origin_m;
                if let Primitive::HalfSpace = shape {
                    let up = Vector::new(axes[0].z, axes[1].z, axes[2].z);
                    let height_m = up.dot(away) - reach_m;
                    return height_m > 0.0 && (height_m > radius_m || height_m > up.abs().dot(half_m));
                }
                let at = into(axes, away);
                shape.away_m(at) > reach_m + radius_m || is_beside(axes, at, [-*half, *half])
            }),
            Form::Mesh(mesh) => {
                let at = into(&self.axes, centre_m - self.origin_m);
                let box_m = [self.solid.low_m, self.solid.high_m];
                is_beside(&self.axes, at, box_m) || mesh.is_clear(at, reach_m + radius_m)
            }
        }
    }

    /// Whether the box around the body and the box between two corners have nothing in common.
    pub(crate) fn is_apart(&self, [low_m, high_m]: [[f64; 3]; 2]) -> bool {
        let half = (self.solid.high_m - self.solid.low_m) * 0.5;
        if half.max_element() == f64::INFINITY {
            return false;
        }
        let middle = self.turned((self.solid.high_m + self.solid.low_m) * 0.5) + self.origin_m;
        (0..3).any(|k| {
            let reach = self.axes[k].abs().dot(half);
            middle[k] + reach < low_m[k] || middle[k] - reach > high_m[k]
        })
    }

    fn turned(&self, v: Vector) -> Vector {
        let [x, y, z] = self.axes;
        Vector::new(x.dot(v), y.dot(v), z.dot(v))
    }
}

/// `v` by the columns of a rotation.
pub(super) fn into([x, y, z]: &[Vector; 3], v: Vector) -> Vector {
    *x * v.x + *y * v.y + *z * v.z
}

impl Solid {
    /// The solid of `mesh`, whose indices must be valid.
    pub fn new(mesh: &TriMesh) -> Self {
        let corner = |i: u32| Vector::from(mesh.vertices[i as usize]);
        let triangle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            Triangle { corner_m: a, edges_m: [b - a, c - a], size_m2: (b - a).length() * (c - a).length() }
        };
        let boxed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            // wider than the slack of a triangle
            let margin = Vector::splat(4.0 * SLACK * ((b - a).length() + (c - a).length()));
            Aabb::new(a.min(b).min(c) - margin, a.max(b).max(c) + margin)
        };
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(boxed).collect();
        let empty = (Vector::splat(f64::INFINITY), Vector::splat(f64::NEG_INFINITY));
        let (low_m, high_m) = boxes.iter().fold(empty, |(low, high), b| (low.min(b.mins), high.max(b.maxs)));
        let mesh = Mesh {
            triangles: mesh.triangles.iter().map(triangle).collect(),
            boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            closed: mesh.is_solid(),
        };
        Self { form: Arc::new(Form::Mesh(mesh)), low_m, high_m }
    }

    /// The union of `parts`.
    pub fn of_parts(parts: Vec<Part>) -> Self {
        let (mut low_m, mut high_m) = (Vector::splat(f64::INFINITY), Vector::splat(f64::NEG_INFINITY));
        for part in &parts {
            let (half, at) = (part.shape.reach_m(), Vector::from(part.position_m));
            // 0 · ∞ is no number
            let reach = part
                .rotation
                .map(|row| if half.x == f64::INFINITY { half.x } else { Vector::from(row).abs().dot(half) });
            low_m = low_m.min(at - Vector::from(reach));
            high_m = high_m.max(at + Vector::from(reach));
        }
        Self { form: Arc::new(Form::Parts(parts)), low_m, high_m }
    }

    /// Whether both are clones of one.
    pub(super) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.form, &other.form)
    }

    /// Its convex parts; empty for a mesh.
    pub fn parts(&self) -> &[Part] {
        match &*self.form {
            Form::Parts(parts) => parts,
            Form::Mesh(_) => &[],
        }
    }

    /// Largest distance of its box from the origin of its axes, m; 0 for what has no end.
    pub(crate) fn radius_m(&self) -> f64 {
        let far_m = self.low_m.abs().max(self.high_m.abs()).length();
        if far_m.is_finite() { far_m } else { 0.0 }
    }

    /// The solid where `body` is.
    pub(crate) fn standing(&self, body: &PosedMesh<'_>) -> Standing<'_> {
        let (axes, origin_m) = (body.rotation.map(Vector::from), Vector::from(body.position_m));
        let turned = |v: Vector| Vector::new(axes[0].dot(v), axes[1].dot(v), axes[2].dot(v));
        let parts = self.parts().iter().map(|part| {
            // world = R_b (R_p · part + p) + o; a row of R_b R_p is a column of its inverse
            let columns = [0, 1, 2].map(|j| turned(Vector::from(part.rotation.map(|row| row[j]))));
            let rows = [0, 1, 2].map(|i| Vector::new(columns[0][i], columns[1][i], columns[2][i]));
            let origin_m = turned(Vector::from(part.position_m)) + origin_m;
            StandingPart { shape: part.shape, axes: rows, origin_m, half_m: part.shape.reach_m() }
        });
        Standing { solid: self, axes, origin_m, parts: parts.collect() }
    }

    /// How far a ray of `reach_m` goes until it meets the mesh, and the normal there, which faces the ray.
    pub(super) fn surface(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<(f64, Vector)> {
        let Form::Mesh(mesh) = &*self.form else { return None };
        let (leaf, hit) = mesh.nearest(start_m, direction, reach_m)?;
        let [e, f] = mesh.triangles[leaf as usize].edges_m;
        let normal = e.cross(f).normalize();
        Some((hit.distance_m, if hit.enters { normal } else { -normal }))
    }
}

impl Mesh {
    /// [`Standing::front_m`]; `beside` tells that the base is outside the box around the mesh.
    fn front_m(&self, base_m: Vector, outward: Vector, thickness_m: f64, gap_m: f64, beside: bool) -> Option<f64> {
        let (mut from_m, reach_m) = (0.0, thickness_m + gap_m);
        while let Some(hit) = self.first(base_m + outward * from_m, outward, reach_m - from_m) {
            let at_m = from_m + hit.distance_m;
            if hit.enters || !self.closed {
                return Some(thickness_m - at_m);
            }
            if from_m <= 0.0 && self.is_through(base_m, outward, at_m) {
                return Some(thickness_m + self.behind_m(base_m, outward, thickness_m));
            }
            // past what comes from behind, to what may enter from outside
            from_m = at_m + SLACK * thickness_m;
        }
        if from_m > 0.0 || beside || (self.closed && !self.holds(base_m)) {
            return None;
        }
        // without a far side, an open mesh goes on for ever
        let out_m = match self.first(base_m, outward, f64::INFINITY) {
            Some(hit) if !hit.enters || !self.closed => hit.distance_m,
            None if !self.closed => f64::INFINITY,
            _ => return None,
        };
        let through = self.is_through(base_m, outward, out_m);
        through.then(|| thickness_m + self.behind_m(base_m, outward, thickness_m))
    }

    /// Whether a closed mesh has nothing of itself within `radius_m` of a place, m.
    fn is_clear(&self, place_m: Vector, radius_m: f64) -> bool {
        let around = Aabb::new(place_m - radius_m, place_m + radius_m);
        let near = |leaf: u32| {
            let Triangle { corner_m: a, edges_m: [e, f], .. } = self.triangles[leaf as usize];
            parry3d_f64::shape::Triangle::new(a, a + e, a + f).distance_to_local_point(place_m, false) <= radius_m
        };
        self.closed && !self.boxes.intersect_aabb(&around).any(near) && !self.holds(place_m)
    }

    /// Whether a place, m, is inside a closed mesh: by the ray to the nearest side of the box around it, which meets
    /// little.
    fn holds(&self, place_m: Vector) -> bool {
        let root = self.boxes.root_aabb();
        if place_m.cmplt(root.mins).any() || place_m.cmpgt(root.maxs).any() {
            return false;
        }
        let (below, above) = (place_m - root.mins, root.maxs - place_m);
        let (low, high) = (below.min_element(), above.min_element());
        let (gaps, nearest, sign) = if low < high { (below, low, -1.0) } else { (above, high, 1.0) };
        let mut direction = Vector::ZERO;
        let axis = (0..3).find(|k| gaps[*k] <= nearest).unwrap_or(0);
        direction[axis] = sign;
        self.first(place_m, direction, f64::INFINITY).is_some_and(|hit| !hit.enters)
    }

    /// Whether a solid that has `base_m` inside, and ends `out_m` outward of it, reaches less far the other way.
    fn is_through(&self, base_m: Vector, outward: Vector, out_m: f64) -> bool {
        let inward = self.first(base_m, -outward, f64::INFINITY);
        inward.is_some_and(|hit| (!hit.enters || !self.closed) && hit.distance_m < out_m)
    }

    /// How far the solid goes on behind `base_m`, m, at most `most_m`.
    fn behind_m(&self, base_m: Vector, outward: Vector, most_m: f64) -> f64 {
        self.first(base_m, -outward, most_m).map_or(most_m, |hit| hit.distance_m)
    }

    fn first(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<Hit> {
        self.nearest(start_m, direction, reach_m).map(|(_, hit)| hit)
    }

    fn nearest(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<(u32, Hit)> {
        let inverse = direction.recip();
        self.boxes.find_best(
            reach_m,
            |node, nearest_m| boxed(node.mins(), node.maxs(), start_m, inverse, nearest_m),
            |leaf, _| self.triangles[leaf as usize].hit(start_m, direction),
        )
    }
}

impl Triangle {
    /// T. Möller and B. Trumbore, Fast, minimum storage ray/triangle intersection, J. Graphics Tools 2 (1997) 21.
    #[inline]
    fn hit(&self, start_m: Vector, direction: Vector) -> Option<Hit> {
        let (distance_m, determinant) = self.meets(start_m, direction);
        (distance_m < f64::INFINITY).then_some(Hit { distance_m, enters: determinant > 0.0 })
    }

    /// Distance at which a ray meets it, infinity if it does not, and a number that is positive where the ray enters.
    /// Without branches.
    #[inline(always)]
    fn meets(&self, start_m: Vector, direction: Vector) -> (f64, f64) {
        let [e, f] = self.edges_m;
        let p = direction.cross(f);
        let determinant = e.dot(p);
        let inverse = 1.0 / determinant;
        let from_corner = start_m - self.corner_m;
        let u = from_corner.dot(p) * inverse;
        let q = from_corner.cross(e);
        let v = direction.dot(q) * inverse;
        let distance_m = f.dot(q) * inverse;
        let faces = determinant.abs() > EDGE_ON * self.size_m2;
        let within = (u >= -SLACK) & (v >= -SLACK) & (u + v <= 1.0 + SLACK);
        (if faces & within & (distance_m >= 0.0) { distance_m } else { f64::INFINITY }, determinant)
    }
}

/// Distance at which a ray enters a box, if that is below `nearest_m`.
#[inline]
fn boxed(low_m: Vector, high_m: Vector, start_m: Vector, inverse: Vector, nearest_m: f64) -> f64 {
    let (one, other) = ((low_m - start_m) * inverse, (high_m - start_m) * inverse);
    let (mut enters, mut leaves) = (0.0, nearest_m);
    for k in 0..3 {
        let (a, b) = (one[k], other[k]);
        // 0 · ∞, a ray in the plane of the lower side, stays in front; there every comparison is false
        let (near, far) = if b < a { (b, a) } else { (a, b) };
        enters = if near > enters { near } else { enters };
        leaves = if far < leaves { far } else { leaves };
    }
    if enters <= leaves { enters } else { f64::MAX }
}
