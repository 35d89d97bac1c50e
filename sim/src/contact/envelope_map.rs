//! The height map of a pose, kept while the body only moves up and down.

use super::PosedMesh;
use super::envelope_raster::{Cells, Patch, Raster};
use crate::mesh::TriMesh;

/// Rotation and place of a body, bit for bit: everything of a pose but its height.
pub(super) type Stand = [u64; 11];

pub(super) fn stand(body: &PosedMesh<'_>) -> Stand {
    let [a, b, c] = body.rotation;
    let [x, y, _] = body.position_m;
    [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], x, y].map(f64::to_bits)
}

/// Height of a vertex above the body's origin, world axes, m.
#[inline]
pub(super) fn height_m(up: [f64; 3], v: &[f64; 3]) -> f64 {
    up[0] * v[0] + up[1] * v[1] + up[2] * v[2]
}

/// From body axes to cells: (column, row) of a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct ToCells {
    u: [f64; 4],
    v: [f64; 4],
}

impl ToCells {
    pub(super) fn new(raster: &Raster, body: &PosedMesh<'_>) -> Self {
        let ([x, y, _], [px, py, _]) = (body.rotation, body.position_m);
        let ([u, v], per_m) = (raster.cells([px, py]), 1.0 / raster.cell_m);
        Self {
            u: [x[0] * per_m, x[1] * per_m, x[2] * per_m, u],
            v: [-y[0] * per_m, -y[1] * per_m, -y[2] * per_m, v],
        }
    }

    /// Vertex `p` as (column, row, height), its height above the body's origin being known.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "called at every corner of every triangle near the skin")]
    pub(super) fn corner(&self, p: [f64; 3], height_m: f64) -> [f64; 3] {
        let along = |a: [f64; 4]| a[0] * p[0] + a[1] * p[1] + a[2] * p[2] + a[3];
        [along(self.u), along(self.v), height_m]
    }
}

/// Lower envelope of one body at one stand, relative to the body's origin.
///
/// It belongs to the mesh it was made of: its copy is compared, since neither an address nor a length tells whether a
/// mesh is still the same.
#[derive(Debug, Clone)]
pub(super) struct HeightMap {
    stand: Stand,
    mesh: TriMesh,
    /// Complete below this height above the origin, m.
    reach_m: f64,
    patch: Patch,
    drop_m: Vec<f64>,
}

impl Default for HeightMap {
    fn default() -> Self {
        Self {
            stand: Stand::default(),
            mesh: TriMesh::default(),
            reach_m: f64::NEG_INFINITY,
            patch: Patch::default(),
            drop_m: Vec::new(),
        }
    }
}

impl HeightMap {
    /// Whether this is the map of `body` at `stand`, complete below `level_m`.
    pub(super) fn serves(&self, body: &PosedMesh<'_>, stand: &Stand, level_m: f64) -> bool {
        level_m <= self.reach_m && self.stand == *stand && same_bits(&self.mesh, body.mesh)
    }

    /// Map of `body` below `reach_m` above its origin; `height_m` are the heights of its vertices.
    pub(super) fn build(raster: &Raster, body: &PosedMesh<'_>, height_m: &[f64], reach_m: f64) -> Self {
        let low = |t: &&[u32; 3]| t.iter().any(|&i| height_m[i as usize] < reach_m);
        let to_cells = ToCells::new(raster, body);
        let corners =
            |t: &[u32; 3]| t.map(|i| to_cells.corner(body.mesh.vertices[i as usize], height_m[i as usize]));
        let mut patch = Patch::default();
        for triangle in body.mesh.triangles.iter().filter(low) {
            if let Some(span) = raster.span(corners(triangle)) {
                patch.include(span);
            }
        }
        let mut drop_m = vec![f64::NEG_INFINITY; patch.height() * patch.width()];
        let mut cells = Cells {
            values: &mut drop_m,
            origin: [patch.rows[0], patch.cols[0]],
            stride: patch.width(),
            level_m: 0.0,
        };
        for triangle in body.mesh.triangles.iter().filter(low) {
            raster.add(&mut cells, corners(triangle));
        }
        Self {
            stand: stand(body),
            mesh: body.mesh.clone(),
            reach_m,
            patch,
            drop_m,
        }
    }

    /// The cells it covers.
    pub(super) fn patch(&self) -> Patch {
        self.patch
    }

    /// How far the envelope is below the body's origin, m, over the patch, row-major; −∞ beside the body.
    pub(super) fn drop_m(&self) -> &[f64] {
        &self.drop_m
    }
}

/// Same numbers, bit for bit (a NaN equals itself, 0 is not −0).
fn same_bits(a: &TriMesh, b: &TriMesh) -> bool {
    let (p, q) = (a.vertices.as_flattened(), b.vertices.as_flattened());
    p.len() == q.len()
        // no early exit: the loop becomes vector instructions
        && p.iter().zip(q).fold(0, |other, (p, q)| other | (p.to_bits() ^ q.to_bits())) == 0
        && a.triangles.as_flattened() == b.triangles.as_flattened()
}
