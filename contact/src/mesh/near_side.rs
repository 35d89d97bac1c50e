//! Meshes that are not closed, pressed as they are: what of their holes the skin would feel.

use super::tri_mesh::{Sides, TriMesh};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};
use std::cell::Cell;

/// Triangles that are tried at most; a mesh that needs more is one whose holes show.
const MAX_TRIED: usize = 30_000_000;
/// How far beside a triangle, or above it, a place still counts as covered, as part of the extent.
const COVERED_FRACTION: f64 = 1e-6;

impl TriMesh {
    /// The lowest edge of one triangle that is seen from below: a body whose surface ends there may be felt beyond it.
    /// `None` if other triangles lie below all such edges, so that no hole changes what touches a skin below.
    pub(super) fn edge_open_below(&self) -> Option<[u32; 2]> {
        let margin_m = COVERED_FRACTION * self.extent_m();
        let boxed = |t: usize| {
            let [a, b, c] = self.corners(t).map(Vector::from);
            Aabb::new(a.min(b).min(c), a.max(b).max(c))
        };
        let boxes: Vec<Aabb> = (0..self.triangles.len()).map(boxed).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let sides = Sides::of(self);
        let left = Cell::new(MAX_TRIED);
        let shown = sides.edges().filter_map(|edge| {
            let [side] = edge else { return None };
            let [x, y, z] = self.middle_m(side.edge);
            let above = |node: &BvhNode| {
                let (low, high) = (node.mins(), node.maxs());
                let beside =
                    x < low.x - margin_m || x > high.x + margin_m || y < low.y - margin_m || y > high.y + margin_m;
                beside || z < low.z - margin_m
            };
            let covers = |t: u32| {
                left.set(left.get().saturating_sub(1));
                left.get() == 0 || (t != side.triangle && self.is_over([x, y, z], t as usize, margin_m))
            };
            let cost = |node: &BvhNode, best: f64| if best <= 0.0 || above(node) { f64::MAX } else { 0.0 };
            let found = tree.find_best(f64::INFINITY, cost, |t, _| covers(t).then_some(0.0));
            (left.get() == 0 || found.is_none()).then_some((z, side.edge))
        });
        shown.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, edge)| edge)
    }

    /// Whether `point` lies above triangle `t`, or in it.
    fn is_over(&self, point: [f64; 3], t: usize, margin_m: f64) -> bool {
        let [a, b, c] = self.corners(t);
        let side = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (point[1] - p[1]) - (q[1] - p[1]) * (point[0] - p[0]);
        let length = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]).hypot(q[1] - p[1]);
        let whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let turned = whole.signum();
        let inside = |p, q| turned * side(p, q) >= -margin_m * length(p, q);
        if whole == 0.0 || !(inside(a, b) && inside(b, c) && inside(c, a)) {
            return false;
        }
        let [u, v, w] = [side(b, c), side(c, a), side(a, b)].map(|part| part / whole);
        u * a[2] + v * b[2] + w * c[2] <= point[2] + margin_m
    }
}
