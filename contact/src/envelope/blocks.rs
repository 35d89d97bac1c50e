//! A mesh in blocks of neighbouring triangles, so that whole blocks above the skin are passed over.

use super::raster::{Raster, cross, least};
use crate::body::PosedMesh;
use crate::mesh::TriMesh;
use std::ops::Range;
use std::sync::Arc;

/// Most triangles of a block.
const BLOCK: usize = 16;

/// Round-off of a block's lowest height, m: a block this close is looked at.
const MARGIN_M: f64 = 1e-12;

/// A copy of a mesh, its triangles sorted into blocks that lie together.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    /// Shared with whoever gave it, so that nobody can change it.
    source: Arc<TriMesh>,
    blocks: Vec<Block>,
    /// Corners of the blocks, each block its own, body axes, m.
    points_m: Vec<[f64; 3]>,
    /// Triangles, by the corners of their block.
    triangles: Vec<[u32; 3]>,
    /// Corners of one block in cells.
    corners: Vec<[f64; 3]>,
    /// Whether the mesh is closed and its triangles face outward: those that face up are then nowhere the lowest.
    solid: bool,
    radius_m: f64,
}

#[derive(Debug, Clone)]
struct Block {
    centre_m: [f64; 3],
    half_m: [f64; 3],
    points: Range<usize>,
    triangles: Range<usize>,
}

impl Blocks {
    pub(super) fn new(mesh: Arc<TriMesh>) -> Self {
        let squared = |p: &[f64; 3]| dot(*p, p);
        let mut blocks = Self {
            solid: mesh.is_solid(),
            radius_m: mesh.vertices.iter().map(squared).fold(0.0, f64::max).sqrt(),
            source: Arc::clone(&mesh),
            ..Self::default()
        };
        let mut order = mesh.triangles.clone();
        blocks.split(&mut order);
        blocks.corners = vec![[0.0; 3]; 3 * BLOCK];
        blocks
    }

    /// Whether this is `mesh`, bit for bit. The same address tells, since what is there is shared and cannot change;
    /// another one does not, and comparing takes about 1 µs for 20 kB.
    pub(super) fn is_of(&self, mesh: &TriMesh) -> bool {
        if std::ptr::eq(mesh, &raw const *self.source) {
            return true;
        }
        let (p, q) = (self.source.vertices.as_flattened(), mesh.vertices.as_flattened());
        p.len() == q.len()
            // no early exit: the loop becomes vector instructions
            && p.iter().zip(q).fold(0, |other, (p, q)| other | (p.to_bits() ^ q.to_bits())) == 0
            && self.source.triangles.as_flattened() == mesh.triangles.as_flattened()
    }

    /// Halves the triangles along the longest side of the box around their centres until they make a block.
    fn split(&mut self, triangles: &mut [[u32; 3]]) {
        let source = Arc::clone(&self.source);
        let vertices = &source.vertices;
        if triangles.len() <= BLOCK {
            self.push(vertices, triangles);
            return;
        }
        // three times the centre
        let centre = |t: &[u32; 3], k: usize| t.iter().map(|&i| vertices[i as usize][k]).sum::<f64>();
        let side = |k: usize| {
            let ends = triangles.iter().map(|t| centre(t, k));
            ends.clone().fold(f64::NEG_INFINITY, f64::max) - ends.fold(f64::INFINITY, f64::min)
        };
        let sides = [side(0), side(1), side(2)];
        let longest = (0..3).max_by(|&i, &j| sides[i].total_cmp(&sides[j])).unwrap_or(0);
        let middle = triangles.len() / 2;
        triangles.select_nth_unstable_by(middle, |s, t| centre(s, longest).total_cmp(&centre(t, longest)));
        let (low, high) = triangles.split_at_mut(middle);
        self.split(low);
        self.split(high);
    }

    /// One more block, of triangles with their corners in `vertices`.
    fn push(&mut self, vertices: &[[f64; 3]], triangles: &[[u32; 3]]) {
        let (first_point, first_triangle) = (self.points_m.len(), self.triangles.len());
        let mut known: Vec<u32> = Vec::with_capacity(3 * BLOCK);
        for t in triangles {
            let local = t.map(|i| {
                let at = known.iter().position(|&k| k == i).unwrap_or_else(|| {
                    known.push(i);
                    self.points_m.push(vertices[i as usize]);
                    known.len() - 1
                });
                u32::try_from(at).unwrap_or(u32::MAX)
            });
            self.triangles.push(local);
        }
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &self.points_m[first_point..] {
            low = [0, 1, 2].map(|k| low[k].min(p[k]));
            high = [0, 1, 2].map(|k| high[k].max(p[k]));
        }
        self.blocks.push(Block {
            centre_m: [0, 1, 2].map(|k| 0.5 * (low[k] + high[k])),
            half_m: [0, 1, 2].map(|k| 0.5 * (high[k] - low[k])),
            points: first_point..self.points_m.len(),
            triangles: first_triangle..self.triangles.len(),
        });
    }

    /// A height above the body's origin that no point of the mesh is below, m.
    pub(super) fn lowest_m(&self, up: [f64; 3]) -> f64 {
        self.blocks.iter().map(|b| b.lowest_m(up)).fold(f64::INFINITY, f64::min)
    }

    /// Distance of the farthest corner from the body's origin, m.
    pub(super) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The triangles for which `keep` holds, in the same blocks. It is asked with the corners as in [`Blocks::below`],
    /// and whether the mesh is solid.
    pub(super) fn kept(
        &self,
        raster: &Raster,
        body: &PosedMesh<'_>,
        mut keep: impl FnMut([[f64; 3]; 3], bool) -> bool,
    ) -> Self {
        let stand = OnGrid::new(raster, body);
        let mut kept = Self {
            source: Arc::clone(&self.source),
            corners: self.corners.clone(),
            solid: self.solid,
            radius_m: self.radius_m,
            ..Self::default()
        };
        for block in &self.blocks {
            let points_m = &self.points_m[block.points.clone()];
            let corners: Vec<[f64; 3]> = points_m.iter().map(|p| stand.place(p)).collect();
            let mut triangles = self.triangles[block.triangles.clone()].to_vec();
            triangles.retain(|t| keep(t.map(|i| corners[i as usize]), self.solid));
            if !triangles.is_empty() {
                kept.push(points_m, &triangles);
            }
        }
        kept
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
        let stand = OnGrid::new(raster, body);
        for block in &self.blocks {
            // not ≥: a pose that is not a number is not passed over
            if block.lowest_m(stand.up) >= level_m {
                continue;
            }
            for (corner, p) in self.corners.iter_mut().zip(&self.points_m[block.points.clone()]) {
                *corner = stand.place(p);
            }
            for &[i, j, k] in &self.triangles[block.triangles.clone()] {
                let corners = [i, j, k].map(|i| self.corners[i as usize]);
                if self.solid && faces_up(corners) {
                    continue;
                }
                if least([corners[0][2], corners[1][2], corners[2][2]]) < level_m {
                    each(corners);
                }
            }
        }
    }
}

/// A pose in the coordinates of the grid.
struct OnGrid {
    u: [f64; 3],
    v: [f64; 3],
    up: [f64; 3],
    origin: [f64; 2],
}

impl OnGrid {
    fn new(raster: &Raster, body: &PosedMesh<'_>) -> Self {
        let ([x, y, up], [px, py, _], per_m) = (body.rotation, body.position_m, 1.0 / raster.cell_m);
        Self {
            u: x.map(|x| x * per_m),
            v: y.map(|y| -y * per_m),
            up,
            origin: raster.cells([px, py]),
        }
    }

    /// (column, row, height above the body's origin in m) of a point of the body.
    #[inline]
    fn place(&self, p: &[f64; 3]) -> [f64; 3] {
        let [u0, v0] = self.origin;
        [dot(self.u, p) + u0, dot(self.v, p) + v0, dot(self.up, p)]
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
    cross(a, b, [c[0], c[1]]) < 0.0
}

#[inline]
fn dot(a: [f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
