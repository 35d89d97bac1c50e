//! Lower envelope of a posed triangle mesh on the skin's fine grid.

use crate::field::{Patch, PosedMesh};
use crate::mesh::TriMesh;
use crate::prepared::{BLOCK, Block, PreparedMesh};
use crate::surface::Standing;
use parts::Parts;
pub(crate) use parts::{Part, split_cell};
use raster::{Cells, Raster, least};
use spts_models::SkinLayout;
use std::ops::Range;

mod parts;
mod raster;
#[cfg(test)]
mod tests;

/// Depth below the skin's free surface, sampled at the centres of fine cells: the deepest point of the mesh above each
/// centre, exact for the triangle mesh. Holes and concave undersides need no special care. Cells in which the surface
/// ends, or turns within less than a cell, have parts instead ([`Part`]): a cell that a body covers in part counts in
/// part, and what lies between the centres is not missed.
///
/// Heights are taken relative to the body's origin and its own height is added last. A body that comes again with the
/// same rotation and place (bit for bit) therefore gets the very same depths from a map kept of it, which is made at
/// the second call.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    raster: Raster,
    depth_m: Vec<f64>,
    /// Parts below the surface, in the order of cells.
    parts: Vec<Part>,
    touched: Patch,
    known: KnownBody,
}

/// What an envelope knows of a body: its mesh in blocks, where it stood last, and the height map there.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownBody {
    blocks: Blocks,
    /// Those of the last stand that was looked at without a map.
    parts: Parts,
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
            parts: Vec::new(),
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

    /// Depth below the free surface, m, row-major; 0 where nothing dips below it. Of a cell with parts it is that of
    /// the deepest.
    pub(crate) fn depth_m(&self) -> &[f64] {
        &self.depth_m
    }

    /// The parts below the free surface of the cells of a line, cell by cell.
    pub(crate) fn parts(&self, line: &Range<usize>) -> &[Part] {
        within(&self.parts, line)
    }

    /// Whether the last body without a map has a rim in a cell.
    #[cfg(test)]
    pub(crate) fn has_parts(&self, cell: usize) -> bool {
        self.known.parts.marked().contains(&[cell / self.raster.cols, cell % self.raster.cols])
    }

    /// Where a part is, (x, y), m.
    pub(crate) fn place_m(&self, part: &Part) -> [f64; 2] {
        self.raster.place_m(part.place)
    }

    /// Rasterises the parts of `body` below z = 0 and returns the cells that may have a depth. Only the cells of the
    /// previous call are cleared. Allocates only for another mesh than the last one and for a map larger than any
    /// before.
    pub(crate) fn rasterise(&mut self, body: &PosedMesh<'_>) -> Patch {
        self.clear();
        self.take(body);
        let (level_m, stand) = (-body.position_m[2], stand(body));
        let again = self.known.stand == stand;
        if again && !self.known.map.serves(&stand, level_m) {
            let [_, _, up] = body.rotation;
            let depth_m = level_m - self.known.blocks.lowest_m(up);
            if depth_m > 0.0 {
                let reach_m = level_m + depth_m.max(REACH_M);
                self.known.make_map(&self.raster, body, reach_m);
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

    /// As [`Envelope::rasterise`] for a body of closed forms, exact at the centres of cells. `None`, and nothing is
    /// done, if a part has an edge, or curves more sharply than a cell.
    pub(crate) fn sample(&mut self, body: &Standing<'_>) -> Option<Patch> {
        let raster = &self.raster;
        if !body.is_smooth(raster.cell_m) {
            return None;
        }
        self.clear();
        self.known.stand = Stand::default();
        for part in body.parts() {
            let Some([low, high]) = part.below_m() else { continue };
            let [[left, bottom], [right, top]] = [low, high].map(|at| self.raster.cells(at));
            let Some(patch) = self.raster.span([[left, bottom, 0.0], [right, top, 0.0], [left, top, 0.0]]) else {
                continue;
            };
            for (row, line) in (patch.rows[0]..).zip(patch.lines(self.raster.cols)) {
                let mut cols = [usize::MAX, 0];
                for (col, depth_m) in (patch.cols[0]..).zip(&mut self.depth_m[line]) {
                    let own_m = -part.lowest_m(self.raster.centre_m(row, col));
                    if own_m > 0.0 {
                        *depth_m = depth_m.max(own_m);
                        cols = [cols[0].min(col), col + 1];
                    }
                }
                if cols[0] < cols[1] {
                    self.touched.include(Patch { rows: [row, row + 1], cols });
                }
            }
        }
        Some(self.touched)
    }

    /// Clears the depths of the last body.
    fn clear(&mut self) {
        for line in self.touched.lines(self.raster.cols) {
            self.depth_m[line].fill(0.0);
        }
        self.touched = Patch::default();
        self.parts.clear();
    }

    /// Cells with parts have the depth of the deepest.
    fn place_parts(&mut self) {
        for part in &self.parts {
            self.depth_m[part.cell] = 0.0;
        }
        let cols = self.raster.cols;
        for part in &self.parts {
            let depth_m = &mut self.depth_m[part.cell];
            *depth_m = depth_m.max(part.depth_m);
            let (row, col) = (part.cell / cols, part.cell % cols);
            self.touched.include(Patch { rows: [row, row + 1], cols: [col, col + 1] });
        }
    }

    /// Replaces every depth beyond `thickness_m` by `depth_m` of the cell's centre, or the part's, (x, y), m; whether
    /// one is left.
    pub(crate) fn deeper_than(&mut self, thickness_m: f64, depth_m: impl Fn([f64; 2]) -> f64) -> bool {
        let mut deeper = false;
        for part in &mut self.parts {
            if part.depth_m > thickness_m {
                part.depth_m = depth_m(self.raster.place_m(part.place));
            }
        }
        for (row, line) in (self.touched.rows[0]..).zip(self.touched.lines(self.raster.cols)) {
            for (col, depth) in (self.touched.cols[0]..).zip(&mut self.depth_m[line]) {
                if *depth > thickness_m {
                    *depth = depth_m(self.raster.centre_m(row, col));
                    deeper |= *depth > thickness_m;
                }
            }
        }
        self.place_parts();
        deeper || self.parts.iter().any(|part| part.depth_m > thickness_m)
    }

    /// Makes [`Envelope::map`] the map of the whole underside of `body`, whatever its height, unless it is already.
    pub(crate) fn make_map(&mut self, body: &PosedMesh<'_>) {
        self.take(body);
        if !self.known.map.serves(&stand(body), f64::INFINITY) {
            self.known.make_map(&self.raster, body, f64::INFINITY);
        }
    }

    /// The map made last.
    pub(crate) fn map(&self) -> &HeightMap {
        &self.known.map
    }

    /// The parts of the map's cells in a line, with depths below the body's origin.
    pub(crate) fn map_parts(&self, line: &Range<usize>) -> &[Part] {
        within(&self.known.map.parts.list, line)
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

    /// Whether `mesh` is that of the present body.
    pub(crate) fn knows(&self, mesh: &TriMesh) -> bool {
        self.known.blocks.is_of(mesh)
    }

    /// Exchanges what is known of the present body.
    pub(crate) fn swap_known(&mut self, known: &mut KnownBody) {
        std::mem::swap(&mut self.known, known);
    }

    /// Adds every triangle that dips below `level_m` above the origin.
    fn add_below(&mut self, body: &PosedMesh<'_>, level_m: f64) {
        let KnownBody { blocks, parts, .. } = &mut self.known;
        let mut cells = Cells { values: &mut self.depth_m, origin: [0, 0], stride: self.raster.cols, level_m };
        let (raster, touched) = (&self.raster, &mut self.touched);
        let reach_m = blocks.begin(parts, raster, body, level_m);
        blocks.below(raster, body, reach_m, |corners, low_m| {
            parts.add(raster, corners);
            if low_m < level_m
                && let Some(patch) = raster.add(&mut cells, corners)
            {
                touched.include(patch);
            }
        });
        parts.finish(raster);
        for [row, col] in parts.marked() {
            self.depth_m[row * raster.cols + col] = 0.0;
        }
        self.parts.extend(below(&parts.list, level_m));
        self.place_parts();
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
        self.parts.extend(below(&self.known.map.parts.list, level_m));
    }
}

/// The parts that lie below a level above the body's origin, by their depths below it.
fn below(parts: &[Part], level_m: f64) -> impl Iterator<Item = Part> {
    let lowered = parts.iter().map(move |part| Part { depth_m: level_m + part.depth_m, ..*part });
    lowered.filter(|part| part.depth_m > 0.0)
}

/// The parts of the cells of a line.
fn within<'a>(parts: &'a [Part], line: &Range<usize>) -> &'a [Part] {
    let first = parts.partition_point(|part| part.cell < line.start);
    let count = parts[first..].partition_point(|part| part.cell < line.end);
    &parts[first..first + count]
}

// A mesh divided into blocks of neighbouring triangles, so that whole blocks above the skin can be skipped.

/// A rim whose surface turns on a radius below this many cells is too sharp for samples at the cells' centres.
const FINE: f64 = 0.5;

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

    /// Height of the lowest point above the body's origin, m; infinite without one.
    fn lowest_point_m(&self, up: [f64; 3]) -> f64 {
        let (mut lowest_m, sorted) = (f64::INFINITY, self.mesh.sorted());
        for block in &sorted.blocks {
            if block.lowest_m(up) < lowest_m {
                let heights = sorted.points_m[block.points.clone()].iter().map(|p| dot(up, p));
                lowest_m = heights.fold(lowest_m, f64::min);
            }
        }
        lowest_m
    }

    /// Begins the `parts` of `body` below `level_m` above its origin, with the cells through which its rims go. Returns
    /// the level below which triangles belong to them.
    fn begin(&self, parts: &mut Parts, raster: &Raster, body: &PosedMesh<'_>, level_m: f64) -> f64 {
        parts.forget();
        let [_, _, up] = body.rotation;
        let lowest_m = self.lowest_point_m(up);
        if lowest_m < level_m {
            let to_cells = ToCells::of(raster, body);
            // whatever their height, so that a cell has parts at every level or at none
            let rims = &self.mesh.sorted().rims;
            let fine = rims.partition_point(|rim| rim.radius_m < FINE * raster.cell_m);
            for rim in &rims[..fine] {
                parts.mark(raster, rim.ends_m.map(|p| to_cells.place(&p)));
            }
        }
        parts.begin(raster, lowest_m, level_m)
    }

    /// Calls `each` with the corners, (column, row, height above the body's origin in m), and the lowest height of
    /// every triangle that dips below `level_m` above the origin and may be the lowest somewhere.
    #[inline]
    fn below(&mut self, raster: &Raster, body: &PosedMesh<'_>, level_m: f64, mut each: impl FnMut([[f64; 3]; 3], f64)) {
        let [_, _, up] = body.rotation;
        let to_cells = ToCells::of(raster, body);
        let sorted = self.mesh.sorted();
        for block in &sorted.blocks {
            // not ≥: a pose that is not a number is not passed over
            if block.lowest_m(up) >= level_m {
                continue;
            }
            for (corner, p) in self.corners.iter_mut().zip(&sorted.points_m[block.points.clone()]) {
                *corner = to_cells.place(p);
            }
            for &[i, j, k] in &sorted.triangles[block.triangles.clone()] {
                let corners = [i, j, k].map(|i| self.corners[i as usize]);
                if sorted.solid && faces_up(corners) {
                    continue;
                }
                let low_m = least([corners[0][2], corners[1][2], corners[2][2]]);
                if low_m < level_m {
                    each(corners, low_m);
                }
            }
        }
    }
}

/// Points of a body in the coordinates of a grid: column, row, and height above the body's origin in m.
struct ToCells {
    u: [f64; 3],
    v: [f64; 3],
    up: [f64; 3],
    origin: [f64; 2],
}

impl ToCells {
    fn of(raster: &Raster, body: &PosedMesh<'_>) -> Self {
        let ([x, y, up], [px, py, _], per_m) = (body.rotation, body.position_m, 1.0 / raster.cell_m);
        Self { u: x.map(|x| x * per_m), v: y.map(|y| -y * per_m), up, origin: raster.cells([px, py]) }
    }

    #[inline]
    fn place(&self, p: &[f64; 3]) -> [f64; 3] {
        [dot(self.u, p) + self.origin[0], dot(self.v, p) + self.origin[1], dot(self.up, p)]
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
    parts: Parts,
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
            parts: Parts::default(),
            triangles: Vec::new(),
        }
    }
}

impl KnownBody {
    /// Makes the map of `body`, whose mesh this is, below `reach_m` above its origin.
    fn make_map(&mut self, raster: &Raster, body: &PosedMesh<'_>, reach_m: f64) {
        let (blocks, map) = (&mut self.blocks, &mut self.map);
        let parts = &mut map.parts;
        (map.stand, map.reach_m, map.patch) = (stand(body), reach_m, Patch::default());
        map.triangles.clear();
        let parts_reach_m = blocks.begin(parts, raster, body, reach_m);
        blocks.below(raster, body, parts_reach_m, |corners, low_m| {
            parts.add(raster, corners);
            if low_m < reach_m
                && let Some(span) = raster.span(corners)
            {
                map.patch.include(span);
                map.triangles.push((span, corners));
            }
        });
        parts.finish(raster);
        let place = |cell: usize| [cell / raster.cols, cell % raster.cols];
        for [row, col] in parts.list.iter().map(|part| place(part.cell)) {
            map.patch.include(Patch { rows: [row, row + 1], cols: [col, col + 1] });
        }
        let (patch, width) = (map.patch, map.patch.width());
        map.drop_m.clear();
        map.drop_m.resize(patch.height() * width, f64::NEG_INFINITY);
        let origin = [patch.rows[0], patch.cols[0]];
        let mut cells = Cells { values: &mut map.drop_m, origin, stride: width, level_m: 0.0 };
        for (span, corners) in &map.triangles {
            raster.fill(&mut cells, *span, *corners);
        }
        let number = |[row, col]: [usize; 2]| (row - patch.rows[0]) * width + col - patch.cols[0];
        let holds = |[row, col]: [usize; 2]| {
            (patch.rows[0]..patch.rows[1]).contains(&row) && (patch.cols[0]..patch.cols[1]).contains(&col)
        };
        for at in parts.marked().iter().copied().filter(|at| holds(*at)) {
            map.drop_m[number(at)] = f64::NEG_INFINITY;
        }
        for part in &parts.list {
            let drop_m = &mut map.drop_m[number(place(part.cell))];
            *drop_m = drop_m.max(part.depth_m);
        }
    }
}

impl HeightMap {
    /// Whether this is the map at `stand`, complete below `level_m`.
    fn serves(&self, stand: &Stand, level_m: f64) -> bool {
        level_m <= self.reach_m && self.stand == *stand
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
