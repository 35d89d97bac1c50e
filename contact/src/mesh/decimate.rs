//! Reduces the number of triangles and measures the error.

use super::tri_mesh::{SOFT_MAX_TRIANGLES, TriMesh, dot, sub};
use meshopt::{SimplifyOptions, simplify_decoder};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

/// Largest allowed distance between the surfaces before and after decimation, m. At the default stiffness of the skin,
/// 1.5e7 Pa/m, it changes a pressure by at most 1.5 kPa (3 % of a usual peak), and only at the worst point.
pub const MAX_DECIMATION_ERROR_M: f64 = 1e-4;
/// The same as part of the extent, which is what holds for objects below 50 mm.
const MAX_ERROR_FRACTION: f64 = 2e-3;
/// Simplifications tried from each start before the mesh is left as it is.
const TRIALS: usize = 6;
/// Larger meshes are first brought down to so many triangles, from which the trials start.
const COARSE_TRIANGLES: usize = 60_000;
/// Part of the largest error that this first step may take.
const COARSE_SHARE: f64 = 0.125;

impl TriMesh {
    /// A mesh of at most [`SOFT_MAX_TRIANGLES`] triangles, or of as many more as it takes to stay within
    /// [`MAX_DECIMATION_ERROR_M`] and 0.2 % of the extent, and its error, m. `None` when that saves nothing, or when
    /// the result would not be closed and outward any more; of an open mesh, when it would have more open edges.
    ///
    /// Edges are collapsed in the order of their quadric error (meshoptimizer), onto vertices of the original. The
    /// error is measured, not estimated: the largest distance from any vertex of the original to the new surface, and
    /// from seven points on each new triangle (beside its corners, which are the original's) to the original.
    pub(super) fn decimated(&self) -> Option<(Self, f64)> {
        self.reduced(SOFT_MAX_TRIANGLES, MAX_DECIMATION_ERROR_M.min(MAX_ERROR_FRACTION * self.extent_m()))
    }

    /// A mesh of fewer triangles whose surface is within `tolerance_m` of this one's, and its error, m; `None` when
    /// that saves nothing. The error is measured: the largest distance from any vertex of this mesh to the new surface,
    /// and from seven points on each new triangle to this one.
    ///
    /// ```
    /// use spts_contact::mesh::sphere;
    ///
    /// let ball = sphere(20e-3, 96, 192);
    /// let (coarse, error_m) = ball.within(0.2e-3).expect("a fine ball");
    /// assert!(error_m <= 0.2e-3 && 20 * coarse.triangles.len() < ball.triangles.len());
    /// ```
    pub fn within(&self, tolerance_m: f64) -> Option<(Self, f64)> {
        self.reduced(4, tolerance_m)
    }

    fn reduced(&self, triangles: usize, limit_m: f64) -> Option<(Self, f64)> {
        let coarse = (self.triangles.len() > 2 * COARSE_TRIANGLES)
            .then(|| self.simplified(COARSE_TRIANGLES, COARSE_SHARE * limit_m));
        let original = Nearest::new(self);
        let (volume_m3, open_edges) = (self.volume_m3(), self.open_edges());
        // a surface that moves by at most the limit changes the volume by at most that times its area
        let most_change_m3 = limit_m * self.area_m2();
        // the first step may already have moved slivers too far
        for start in coarse.iter().chain([self]) {
            let mut target_m = limit_m;
            for _ in 0..TRIALS {
                let mesh = start.simplified(triangles, target_m);
                if mesh.triangles.is_empty()
                    || mesh.triangles.len() >= self.triangles.len()
                    || mesh.open_edges() > open_edges
                    || (open_edges == 0 && (mesh.volume_m3() - volume_m3).abs() > most_change_m3)
                {
                    break;
                }
                let error_m = Nearest::new(&mesh)
                    .farthest_m(self.vertices.iter().copied())
                    .max(original.farthest_m(mesh.samples()));
                if error_m <= limit_m {
                    return Some((mesh, error_m));
                }
                target_m *= (limit_m / error_m).clamp(0.25, 0.8);
            }
        }
        None
    }

    /// Simplified towards `triangles` triangles, while meshoptimizer's estimate of the error stays below `error_m`.
    fn simplified(&self, triangles: usize, error_m: f64) -> Self {
        let (low, high) = self.bounds().unwrap_or_default();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "only steers the choice of edges; the vertices keep their f64"
        )]
        let positions: Vec<[f32; 3]> =
            self.vertices.iter().map(|v| [0, 1, 2].map(|k| (v[k] - 0.5 * (low[k] + high[k])) as f32)).collect();
        #[expect(clippy::cast_possible_truncation, reason = "a target, not a result")]
        let target = error_m as f32;
        let options = SimplifyOptions::ErrorAbsolute;
        let corners = self.triangles.as_flattened();
        let kept = simplify_decoder(corners, &positions, 3 * triangles, target, options, None);
        self.with_triangles(kept.as_chunks::<3>().0)
    }

    /// Seven points on each triangle: its centre, the middles of its sides, and half-way from the centre to the
    /// corners.
    fn samples(&self) -> impl Iterator<Item = [f64; 3]> {
        const SHARES: [[f64; 3]; 7] = [
            [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.5],
            [0.5, 0.0, 0.5],
            [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
            [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
            [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
        ];
        (0..self.triangles.len()).flat_map(|t| {
            let [a, b, c] = self.corners(t);
            SHARES.map(|[u, v, w]| [0, 1, 2].map(|k| u * a[k] + v * b[k] + w * c[k]))
        })
    }
}

/// The triangles of a mesh in a hierarchy of boxes, ready to be asked for the nearest.
struct Nearest<'m> {
    mesh: &'m TriMesh,
    boxes: Bvh,
}

impl<'m> Nearest<'m> {
    fn new(mesh: &'m TriMesh) -> Self {
        let boxed = |t: usize| {
            let [a, b, c] = mesh.corners(t).map(Vector::from);
            Aabb::new(a.min(b).min(c), a.max(b).max(c))
        };
        let boxes: Vec<Aabb> = (0..mesh.triangles.len()).map(boxed).collect();
        Self { mesh, boxes: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes) }
    }

    /// Largest distance of any of `points` to the surface, m; 0 without points.
    fn farthest_m(&self, points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
        let (mut most, mut near) = (0.0, 0);
        for p in points {
            // the triangle near the last point is near this one too
            let distance = |t: u32| square_distance(p, self.mesh.corners(t as usize));
            let start = distance(near);
            // what is no farther than the farthest one does not count: the search ends there
            let cost = |node: &BvhNode, best: f64| if best <= most { f64::MAX } else { box_distance(p, node) };
            let found = self.boxes.find_best(start, cost, |t, _| Some(distance(t)));
            let square = found.map_or(start, |(t, square)| {
                near = t;
                square
            });
            most = f64::max(most, square);
        }
        most.sqrt()
    }
}

/// Square of the distance from `p` to the box of `node`, m².
fn box_distance(p: [f64; 3], node: &BvhNode) -> f64 {
    let p = Vector::from(p);
    (node.mins() - p).max(p - node.maxs()).max(Vector::ZERO).length_squared()
}

/// Square of the distance from `p` to the triangle, m².
///
/// Source: C. Ericson, *Real-Time Collision Detection* (2005), §5.1.5: the region of the plane in which the projection
/// of `p` lies.
fn square_distance(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    let (bp, cp) = (sub(p, b), sub(p, c));
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let on = |from: [f64; 3], along: [f64; 3], share: f64| {
        let away = [0, 1, 2].map(|k| p[k] - from[k] - share * along[k]);
        dot(away, away)
    };
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return on(a, ab, d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return on(a, ac, d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return on(b, sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    let away = [0, 1, 2].map(|k| ap[k] - v * ab[k] - w * ac[k]);
    dot(away, away)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cuboid, sphere};
    use approx::assert_relative_eq;

    /// Outside a block the distance is that to a box: through face, edge and corner regions, on a refined surface.
    #[test]
    fn distance_to_a_block() {
        let block = cuboid([2.0, 2.0, 2.0]).refined(0.3, |_, _| true);
        let tree = Nearest::new(&block);
        for (point, expected) in [
            ([0.1, 0.2, 5.0], 3.0),
            ([4.0, 0.3, 1.1], 3.0),
            ([4.0, 5.0, 1.3], 5.0),
            ([2.0, 3.0, 4.0], 3.0),
            ([0.2, 0.1, 1.0], 0.8),
            ([1.0, 0.3, 0.4], 0.0),
        ] {
            // exact geometry; rounding of a few ulp of the coordinates
            assert!((tree.farthest_m([point]) - expected).abs() < 1e-12, "{point:?}");
        }
    }

    /// Centre and shells of a sphere: between the facets' inner radius and the outer one.
    #[test]
    fn distance_to_a_sphere() {
        let ball = sphere(1.0, 40, 80);
        let tree = Nearest::new(&ball);
        // facets lie within 1 − cos(π/40) of the sphere along meridians, the same along the equator's 80
        let sagitta = 2.0 * (1.0 - (std::f64::consts::PI / 80.0).cos());
        assert_relative_eq!(tree.farthest_m([[0.0, 0.0, 1.0]]), 1.0, epsilon = sagitta);
        assert_relative_eq!(tree.farthest_m([[3.0, 0.0, 1.0], [0.0, 0.0, 1.0]]), 2.0, epsilon = sagitta);
    }
}
