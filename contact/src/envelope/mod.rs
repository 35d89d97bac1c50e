//! Lower envelope of a posed triangle mesh on the skin's fine grid.

use crate::field::{Patch, PosedMesh};
use crate::mesh::TriMesh;
use crate::prepared::{BLOCK, Block, PreparedMesh};
use raster::{Cells, Raster, least};
use spts_models::SkinLayout;

mod raster;
#[cfg(test)]
mod tests;

/// Depth below the skin's free surface, sampled at the centres of fine cells: the deepest point of the mesh above each
/// centre, exact for the triangle mesh. Holes and concave undersides need no special care.
///
/// Heights are taken relative to the body's origin and its own height is added last. A body that comes again with the
/// same rotation and place (bit for bit) therefore gets the very same depths from a map kept of it, which is made at
/// the second call.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    raster: Raster,
    depth_m: Vec<f64>,
    touched: Patch,
    known: KnownBody,
}

/// What an envelope knows of a body: its mesh in blocks, where it stood last, and the height map there.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownBody {
    blocks: Blocks,
    stand: Stand,
    map: HeightMap,
}

/// Least height above the present level to which a map is made, m. It is doubled with the depth, so that a body that
/// sinks step by step has its map made again a few times only.
const REACH_M: f64 = 1e-3;

impl Envelope {
    /// Empty envelope over `skin`, `cells_per_taxel` cells along each side of a taxel.
    pub(crate) fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let raster = Raster::new(skin, cells_per_taxel);
        Self {
            depth_m: vec![0.0; raster.rows * raster.cols],
            raster,
            touched: Patch::default(),
            known: KnownBody::default(),
        }
    }

    /// Number of fine rows and columns.
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.raster.rows, self.raster.cols]
    }

    /// Side of a fine cell, m.
    pub(crate) fn cell_m(&self) -> f64 {
        self.raster.cell_m
    }

    /// Centre (x, y) of a fine cell, m.
    pub(crate) fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        self.raster.centre_m(row, col)
    }

    /// Depth below the free surface, m, row-major; 0 where nothing dips below it.
    pub(crate) fn depth_m(&self) -> &[f64] {
        &self.depth_m
    }

    /// Rasterises the parts of `body` below z = 0 and returns the cells that may have a depth. Only the cells of the
    /// previous call are cleared. Allocates only for another mesh than the last one and for a map larger than any
    /// before.
    pub(crate) fn rasterise(&mut self, body: &PosedMesh<'_>) -> Patch {
        for line in self.touched.lines(self.raster.cols) {
            self.depth_m[line].fill(0.0);
        }
        self.touched = Patch::default();
        self.take(body);
        let (level_m, stand) = (-body.position_m[2], stand(body));
        let again = self.known.stand == stand;
        if again && !self.known.map.serves(&stand, level_m) {
            let [_, _, up] = body.rotation;
            let depth_m = level_m - self.known.blocks.lowest_m(up);
            if depth_m > 0.0 {
                let reach_m = level_m + depth_m.max(REACH_M);
                self.known.map.make(&self.raster, &mut self.known.blocks, body, reach_m);
            }
        }
        self.known.stand = stand;
        if again {
            // above the skin there is no map yet, or one with nothing below the level
            if self.known.map.serves(&stand, level_m) {
                self.lower(level_m);
            }
        } else {
            self.add_below(body, level_m);
        }
        self.touched
    }

    /// Replaces every depth beyond `thickness_m` by `depth_m` of the cell's centre (x, y), m; whether one is left.
    pub(crate) fn deeper_than(&mut self, thickness_m: f64, depth_m: impl Fn([f64; 2]) -> f64) -> bool {
        let mut deeper = false;
        for (row, line) in (self.touched.rows[0]..).zip(self.touched.lines(self.raster.cols)) {
            for (col, depth) in (self.touched.cols[0]..).zip(&mut self.depth_m[line]) {
                if *depth > thickness_m {
                    *depth = depth_m(self.raster.centre_m(row, col));
                    deeper |= *depth > thickness_m;
                }
            }
        }
        deeper
    }

    /// Makes [`Envelope::map`] the map of the whole underside of `body`, whatever its height, unless it is already.
    pub(crate) fn make_map(&mut self, body: &PosedMesh<'_>) {
        self.take(body);
        if !self.known.map.serves(&stand(body), f64::INFINITY) {
            self.known.map.make(&self.raster, &mut self.known.blocks, body, f64::INFINITY);
        }
    }

    /// The map made last.
    pub(crate) fn map(&self) -> &HeightMap {
        &self.known.map
    }

    /// Makes the mesh of `body` the present one. With another mesh the map goes.
    fn take(&mut self, body: &PosedMesh<'_>) {
        if !self.known.blocks.is_of(body.mesh) {
            self.expect(&body.mesh.clone().into());
        }
    }

    /// Makes `mesh` the present one. Bodies with it, at its address, need no comparison.
    pub(crate) fn expect(&mut self, mesh: &PreparedMesh) {
        if !self.known.blocks.mesh.is(mesh) {
            self.known.blocks = Blocks::new(mesh.clone());
            self.known.map = HeightMap::default();
        }
    }

    /// Exchanges what is known of the present body.
    pub(crate) fn swap_known(&mut self, known: &mut KnownBody) {
        std::mem::swap(&mut self.known, known);
    }

    /// Adds every triangle that dips below `level_m` above the origin.
    fn add_below(&mut self, body: &PosedMesh<'_>, level_m: f64) {
        let mut cells = Cells { values: &mut self.depth_m, origin: [0, 0], stride: self.raster.cols, level_m };
        let (raster, touched) = (&self.raster, &mut self.touched);
        self.known.blocks.below(raster, body, level_m, |corners| {
            if let Some(patch) = raster.add(&mut cells, corners) {
                touched.include(patch);
            }
        });
    }

    /// Depths out of the map for an origin `level_m` below the free surface.
    fn lower(&mut self, level_m: f64) {
        let (patch, width) = (self.known.map.patch(), self.known.map.patch().width());
        for (row, heights) in (patch.rows[0]..).zip(self.known.map.drop_m().chunks_exact(width.max(1))) {
            let dips = |drop_m: &f64| level_m + drop_m > 0.0;
            let (Some(first), Some(last)) = (heights.iter().position(dips), heights.iter().rposition(dips)) else {
                continue;
            };
            let start = row * self.raster.cols + patch.cols[0];
            let depths = &mut self.depth_m[start + first..=start + last];
            for (depth_m, drop_m) in depths.iter_mut().zip(&heights[first..=last]) {
                let z = level_m + drop_m;
                *depth_m = if z > 0.0 { z } else { 0.0 };
            }
            self.touched
                .include(Patch { rows: [row, row + 1], cols: [patch.cols[0] + first, patch.cols[0] + last + 1] });
        }
    }
}

// A mesh divided into blocks of neighbouring triangles, so that whole blocks above the skin can be skipped.

/// Round-off of a block's lowest height, m: a block this close is looked at.
const MARGIN_M: f64 = 1e-12;

/// The mesh of an envelope, and room for the corners of one of its blocks.
#[derive(Debug, Clone, Default)]
struct Blocks {
    mesh: PreparedMesh,
    /// Corners of one block in cells.
    corners: Vec<[f64; 3]>,
}

impl Blocks {
    fn new(mesh: PreparedMesh) -> Self {
        Self { mesh, corners: vec![[0.0; 3]; 3 * BLOCK] }
    }

    /// Whether this is `mesh`, bit for bit. The same address tells, since what is there is shared and cannot change;
    /// another one does not, and comparing takes about 1 µs for 20 kB.
    fn is_of(&self, mesh: &TriMesh) -> bool {
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
    fn lowest_m(&self, up: [f64; 3]) -> f64 {
        let blocks = self.mesh.sorted().blocks.iter();
        blocks.map(|b| b.lowest_m(up)).fold(f64::INFINITY, f64::min)
    }

    /// Calls `each` with the corners, (column, row, height above the body's origin in m), of every triangle that dips
    /// below `level_m` above the origin and may be the lowest somewhere.
    #[inline]
    fn below(&mut self, raster: &Raster, body: &PosedMesh<'_>, level_m: f64, mut each: impl FnMut([[f64; 3]; 3])) {
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

// The height map of a pose, kept while the body only moves vertically.

/// Rotation and place of a body, bit for bit: everything of a pose but its height.
type Stand = [u64; 11];

fn stand(body: &PosedMesh<'_>) -> Stand {
    let [a, b, c] = body.rotation;
    let [x, y, _] = body.position_m;
    [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], x, y].map(f64::to_bits)
}

/// Lower envelope of one mesh at one stand, relative to the body's origin.
#[derive(Debug, Clone)]
pub(crate) struct HeightMap {
    stand: Stand,
    /// Complete below this height above the origin, m.
    reach_m: f64,
    patch: Patch,
    drop_m: Vec<f64>,
    /// Scratch: triangles over cells, with the cells of their boxes.
    triangles: Vec<(Patch, [[f64; 3]; 3])>,
}

impl Default for HeightMap {
    fn default() -> Self {
        Self {
            stand: Stand::default(),
            reach_m: f64::NEG_INFINITY,
            patch: Patch::default(),
            drop_m: Vec::new(),
            triangles: Vec::new(),
        }
    }
}

impl HeightMap {
    /// Whether this is the map at `stand`, complete below `level_m`.
    fn serves(&self, stand: &Stand, level_m: f64) -> bool {
        level_m <= self.reach_m && self.stand == *stand
    }

    /// Makes it the map of `body`, whose mesh is in `blocks`, below `reach_m` above its origin.
    fn make(&mut self, raster: &Raster, blocks: &mut Blocks, body: &PosedMesh<'_>, reach_m: f64) {
        (self.stand, self.reach_m, self.patch) = (stand(body), reach_m, Patch::default());
        self.triangles.clear();
        blocks.below(raster, body, reach_m, |corners| {
            if let Some(span) = raster.span(corners) {
                self.patch.include(span);
                self.triangles.push((span, corners));
            }
        });
        self.drop_m.clear();
        self.drop_m.resize(self.patch.height() * self.patch.width(), f64::NEG_INFINITY);
        let mut cells = Cells {
            values: &mut self.drop_m,
            origin: [self.patch.rows[0], self.patch.cols[0]],
            stride: self.patch.width(),
            level_m: 0.0,
        };
        for (span, corners) in &self.triangles {
            raster.fill(&mut cells, *span, *corners);
        }
    }

    /// The cells it covers.
    pub(crate) fn patch(&self) -> Patch {
        self.patch
    }

    /// How far the envelope is below the body's origin, m, over the patch, row-major; −∞ beside the body.
    pub(crate) fn drop_m(&self) -> &[f64] {
        &self.drop_m
    }
}
