//! Reduces the number of triangles and measures the error.

use super::nearest::Nearest;
use super::size::SOFT_MAX_TRIANGLES;
use super::tri_mesh::TriMesh;
use meshopt::{SimplifyOptions, simplify_decoder};

/// Largest allowed distance between the surfaces before and after decimation, m. At the default stiffness of the skin,
/// 1.5e7 Pa/m, it changes a pressure by at most 1.5 kPa (3 % of a usual peak), and only at the worst point.
pub const MAX_DECIMATION_ERROR_M: f64 = 1e-4;
/// The same as part of the extent, which is what holds for objects below 50 mm.
const MAX_ERROR_FRACTION: f64 = 2e-3;
/// Simplifications tried before the mesh is left as it is.
const TRIALS: usize = 6;
/// Larger meshes are first brought down to so many triangles, from which the trials start.
const COARSE_TRIANGLES: usize = 60_000;
/// Part of the largest error that this first step may take.
const COARSE_SHARE: f64 = 0.125;

impl TriMesh {
    /// A mesh of at most [`SOFT_MAX_TRIANGLES`] triangles, or of as many more as it takes to stay within
    /// [`MAX_DECIMATION_ERROR_M`] and 0.2 % of the extent, and its error, m. `None` when that saves nothing, or when
    /// the result would not be closed and outward any more.
    ///
    /// Edges are collapsed in the order of their quadric error (meshoptimizer), onto vertices of the original. The
    /// error is measured, not estimated: the largest distance from any vertex of the original to the new surface, and
    /// from seven points on each new triangle (beside its corners, which are the original's) to the original.
    #[must_use]
    pub(super) fn decimated(&self) -> Option<(Self, f64)> {
        let limit_m = MAX_DECIMATION_ERROR_M.min(MAX_ERROR_FRACTION * self.extent_m());
        let coarse = (self.triangles.len() > 2 * COARSE_TRIANGLES)
            .then(|| self.simplified(COARSE_TRIANGLES, COARSE_SHARE * limit_m));
        let start = coarse.as_ref().unwrap_or(self);
        let original = Nearest::new(self);
        let volume_m3 = self.volume_m3();
        // a surface that moves by at most the limit changes the volume by at most that times its area
        let most_change_m3 = limit_m * self.area_m2();
        let mut target_m = limit_m;
        for _ in 0..TRIALS {
            let mesh = start.simplified(SOFT_MAX_TRIANGLES, target_m);
            if mesh.triangles.is_empty()
                || mesh.triangles.len() >= self.triangles.len()
                || mesh.open_edges() > 0
                || (mesh.volume_m3() - volume_m3).abs() > most_change_m3
            {
                return None;
            }
            let error_m = Nearest::new(&mesh)
                .farthest_m(self.vertices.iter().copied())
                .max(original.farthest_m(mesh.samples()));
            if error_m <= limit_m {
                return Some((mesh, error_m));
            }
            target_m *= (limit_m / error_m).clamp(0.25, 0.8);
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
        let positions: Vec<[f32; 3]> = self
            .vertices
            .iter()
            .map(|v| [0, 1, 2].map(|k| (v[k] - 0.5 * (low[k] + high[k])) as f32))
            .collect();
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
