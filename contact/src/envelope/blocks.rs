//! A mesh divided into blocks of neighbouring triangles, so that whole blocks above the skin can be skipped.

use super::raster::{Raster, least};
use crate::body::PosedMesh;
use crate::mesh::TriMesh;
use crate::prepared::{BLOCK, Block, PreparedMesh};

/// Round-off of a block's lowest height, m: a block this close is looked at.
const MARGIN_M: f64 = 1e-12;

/// The mesh of an envelope, and room for the corners of one of its blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    mesh: PreparedMesh,
    /// Corners of one block in cells.
    corners: Vec<[f64; 3]>,
}

impl Blocks {
    pub(super) fn new(mesh: PreparedMesh) -> Self {
        Self {
            mesh,
            corners: vec![[0.0; 3]; 3 * BLOCK],
        }
    }

    /// Whether this is `mesh`, bit for bit. The same address tells, since what is there is shared and cannot change;
    /// another one does not, and comparing takes about 1 µs for 20 kB.
    pub(super) fn is_of(&self, mesh: &TriMesh) -> bool {
        let own: &TriMesh = &self.mesh;
        if std::ptr::eq(mesh, own) {
            return true;
        }
        let (p, q) = (own.vertices.as_flattened(), mesh.vertices.as_flattened());
        p.len() == q.len()
            // no early exit: the loop becomes vector instructions
            && p.iter().zip(q).fold(0, |other, (p, q)| other | (p.to_bits() ^ q.to_bits())) == 0
            && own.triangles.as_flattened() == mesh.triangles.as_flattened()
    }

    /// A height above the body's origin that no point of the mesh is below, m.
    pub(super) fn lowest_m(&self, up: [f64; 3]) -> f64 {
        let blocks = self.mesh.sorted().blocks.iter();
        blocks.map(|b| b.lowest_m(up)).fold(f64::INFINITY, f64::min)
    }

    /// Calls `each` with the corners, (column, row, height above the body's origin in m), of every triangle that dips
    /// below `level_m` above the origin and may be the lowest somewhere.
    #[inline]
    pub(super) fn below(
        &mut self,
        raster: &Raster,
        body: &PosedMesh<'_>,
        level_m: f64,
        mut each: impl FnMut([[f64; 3]; 3]),
    ) {
        let ([x, y, up], [px, py, _], per_m) = (body.rotation, body.position_m, 1.0 / raster.cell_m);
        let (u, v) = (x.map(|x| x * per_m), y.map(|y| -y * per_m));
        let [u0, v0] = raster.cells([px, py]);
        let sorted = self.mesh.sorted();
        for block in &sorted.blocks {
            // not ≥: a pose that is not a number is not passed over
            if block.lowest_m(up) >= level_m {
                continue;
            }
            for (corner, p) in self.corners.iter_mut().zip(&sorted.points_m[block.points.clone()]) {
                *corner = [dot(u, p) + u0, dot(v, p) + v0, dot(up, p)];
            }
            for &[i, j, k] in &sorted.triangles[block.triangles.clone()] {
                let corners = [i, j, k].map(|i| self.corners[i as usize]);
                if sorted.solid && faces_up(corners) {
                    continue;
                }
                if least([corners[0][2], corners[1][2], corners[2][2]]) < level_m {
                    each(corners);
                }
            }
        }
    }
}

impl Block {
    #[inline]
    fn lowest_m(&self, up: [f64; 3]) -> f64 {
        dot(up, &self.centre_m) - dot(up.map(f64::abs), &self.half_m) - MARGIN_M
    }
}

/// Whether a triangle of a solid is seen from above. Corners are (column, row, height): rows go down.
#[inline]
fn faces_up([a, b, c]: [[f64; 3]; 3]) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0.0
}

#[inline]
fn dot(a: [f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
