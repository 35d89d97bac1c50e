//! Distance along a ray to a mesh.

use crate::mesh::TriMesh;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhLeafCost};

/// Share of a triangle by which rays beside it count as hits, so that none passes between two triangles.
const SLACK: f64 = 1e-9;

/// Triangles seen under a smaller sine than this are passed over: the faces beside them are met.
const EDGE_ON: f64 = 1e-9;

/// The triangles of a mesh in a hierarchy of bounding boxes, in body axes.
#[derive(Debug, Clone)]
pub struct Solid {
    triangles: Vec<Triangle>,
    boxes: Bvh,
    /// Lower corner of the box around all triangles, m.
    low_m: Vector,
    high_m: Vector,
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

impl Solid {
    /// The solid of `mesh`, whose indices must be valid.
    #[must_use]
    pub fn new(mesh: &TriMesh) -> Self {
        let corner = |i: u32| Vector::from(mesh.vertices[i as usize]);
        let triangle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            Triangle {
                corner_m: a,
                edges_m: [b - a, c - a],
                size_m2: (b - a).length() * (c - a).length(),
            }
        };
        let boxed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            // wider than the slack of a triangle
            let margin = Vector::splat(4.0 * SLACK * ((b - a).length() + (c - a).length()));
            Aabb::new(a.min(b).min(c) - margin, a.max(b).max(c) + margin)
        };
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(boxed).collect();
        let empty = (Vector::splat(f64::INFINITY), Vector::splat(f64::NEG_INFINITY));
        let (low_m, high_m) = boxes
            .iter()
            .fold(empty, |(low, high), b| (low.min(b.mins), high.max(b.maxs)));
        Self {
            low_m,
            high_m,
            triangles: mesh.triangles.iter().map(triangle).collect(),
            boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            closed: mesh.is_solid(),
        }
    }

    /// How deep the solid reaches below the end of a ray that starts at `start_m` and goes `reach_m` along `direction`
    /// (length 1); 0 where it does not. A start inside the solid counts as the deepest point of a ray.
    pub(super) fn depth_m(&self, start_m: Vector, direction: Vector, reach_m: f64) -> f64 {
        let hit = self.first(start_m, direction, reach_m);
        if let Some(hit) = hit
            && (hit.enters || !self.closed)
        {
            return reach_m - hit.distance_m;
        }
        // it comes out first, or not at all: it may have started inside
        if self.closed && self.holds(start_m, direction) {
            return reach_m;
        }
        hit.map_or(0.0, |hit| reach_m - hit.distance_m)
    }

    /// Whether a point is inside: what is met first, both ways along `direction`, is the way out.
    fn holds(&self, point_m: Vector, direction: Vector) -> bool {
        let out = |direction| {
            let first = self.first(point_m, direction, f64::INFINITY);
            first.is_some_and(|hit| !hit.enters)
        };
        let beside = point_m.cmplt(self.low_m).any() || point_m.cmpgt(self.high_m).any();
        !beside && out(direction) && out(-direction)
    }

    /// How far a ray of `reach_m` goes until it meets the mesh, and the normal there, which faces the ray.
    pub(super) fn surface(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<(f64, Vector)> {
        let (leaf, hit) = self.nearest(start_m, direction, reach_m)?;
        let [e, f] = self.triangles[leaf as usize].edges_m;
        let normal = e.cross(f).normalize();
        Some((hit.distance_m, if hit.enters { normal } else { -normal }))
    }

    fn first(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<Hit> {
        self.nearest(start_m, direction, reach_m).map(|(_, hit)| hit)
    }

    fn nearest(&self, start_m: Vector, direction: Vector, reach_m: f64) -> Option<(u32, Hit)> {
        let inverse = direction.recip();
        self.boxes.find_best(
            reach_m,
            |node, nearest_m| slab(node.mins(), node.maxs(), start_m, inverse, nearest_m),
            |leaf, _| self.triangles[leaf as usize].hit(start_m, direction),
        )
    }
}

impl Triangle {
    /// T. Möller and B. Trumbore, Fast, minimum storage ray/triangle intersection, J. Graphics Tools 2 (1997) 21.
    #[inline]
    fn hit(&self, start_m: Vector, direction: Vector) -> Option<Hit> {
        let [e, f] = self.edges_m;
        let p = direction.cross(f);
        let determinant = e.dot(p);
        if determinant.abs() <= EDGE_ON * self.size_m2 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let from_corner = start_m - self.corner_m;
        let u = from_corner.dot(p) * inverse;
        let q = from_corner.cross(e);
        let v = direction.dot(q) * inverse;
        if u < -SLACK || v < -SLACK || u + v > 1.0 + SLACK {
            return None;
        }
        let distance_m = f.dot(q) * inverse;
        (distance_m >= 0.0).then_some(Hit {
            distance_m,
            enters: determinant > 0.0,
        })
    }
}

/// Distance at which a ray enters a box, if that is below `nearest_m`.
#[inline]
fn slab(low_m: Vector, high_m: Vector, start_m: Vector, inverse: Vector, nearest_m: f64) -> f64 {
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
