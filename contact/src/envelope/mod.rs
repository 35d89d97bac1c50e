//! Lower envelope of a posed triangle mesh on the skin's fine grid.

mod blocks;
mod height_map;
#[cfg(test)]
mod oracle_tests;
mod raster;
#[cfg(test)]
mod tests;

use crate::body::PosedMesh;
use crate::patch::Patch;
use crate::prepared::PreparedMesh;
use blocks::Blocks;
use height_map::{HeightMap, Stand, stand};
use raster::{Cells, Raster};
use spts_models::SkinLayout;

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
    /// Blocks of the last mesh.
    blocks: Blocks,
    touched: Patch,
    /// Position of the last body.
    stand: Stand,
    map: HeightMap,
}

/// Least height above the present level to which a map is made, m. It is doubled with the depth, so that a body that
/// sinks step by step has its map made again a few times only.
const REACH_M: f64 = 1e-3;

impl Envelope {
    /// Empty envelope over `skin`, `cells_per_taxel` cells along each side of a taxel.
    #[must_use]
    pub(crate) fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let raster = Raster::new(skin, cells_per_taxel);
        Self {
            depth_m: vec![0.0; raster.rows * raster.cols],
            raster,
            blocks: Blocks::default(),
            touched: Patch::default(),
            stand: Stand::default(),
            map: HeightMap::default(),
        }
    }

    /// Number of fine rows and columns.
    #[must_use]
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.raster.rows, self.raster.cols]
    }

    /// Side of a fine cell, m.
    #[must_use]
    pub(crate) fn cell_m(&self) -> f64 {
        self.raster.cell_m
    }

    /// Centre (x, y) of a fine cell, m.
    #[must_use]
    pub(crate) fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        self.raster.centre_m(row, col)
    }

    /// Depth below the free surface, m, row-major; 0 where nothing dips below it.
    #[must_use]
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
        let again = self.stand == stand;
        if again && !self.map.serves(&stand, level_m) {
            let [_, _, up] = body.rotation;
            let depth_m = level_m - self.blocks.lowest_m(up);
            if depth_m > 0.0 {
                let reach_m = level_m + depth_m.max(REACH_M);
                self.map.make(&self.raster, &mut self.blocks, body, reach_m);
            }
        }
        self.stand = stand;
        if again {
            // above the skin there is no map yet, or one with nothing below the level
            if self.map.serves(&stand, level_m) {
                self.lower(level_m);
            }
        } else {
            self.add_below(body, level_m);
        }
        self.touched
    }

    /// Makes [`Envelope::map`] the map of the whole underside of `body`, whatever its height, unless it is already.
    pub(crate) fn make_map(&mut self, body: &PosedMesh<'_>) {
        self.take(body);
        if !self.map.serves(&stand(body), f64::INFINITY) {
            self.map.make(&self.raster, &mut self.blocks, body, f64::INFINITY);
        }
    }

    /// The map made last.
    pub(crate) fn map(&self) -> &HeightMap {
        &self.map
    }

    /// Makes the mesh of `body` the present one. With another mesh the map goes.
    fn take(&mut self, body: &PosedMesh<'_>) {
        if !self.blocks.is_of(body.mesh) {
            self.expect(&body.mesh.clone().into());
        }
    }

    /// Makes `mesh` the present one. Bodies with it, at its address, need no comparison.
    pub(crate) fn expect(&mut self, mesh: &PreparedMesh) {
        self.blocks = Blocks::new(mesh.clone());
        self.map = HeightMap::default();
    }

    /// Adds every triangle that dips below `level_m` above the origin.
    fn add_below(&mut self, body: &PosedMesh<'_>, level_m: f64) {
        let mut cells = Cells {
            values: &mut self.depth_m,
            origin: [0, 0],
            stride: self.raster.cols,
            level_m,
        };
        let (raster, touched) = (&self.raster, &mut self.touched);
        self.blocks.below(raster, body, level_m, |corners| {
            if let Some(patch) = raster.add(&mut cells, corners) {
                touched.include(patch);
            }
        });
    }

    /// Depths out of the map for an origin `level_m` below the free surface.
    fn lower(&mut self, level_m: f64) {
        let (patch, width) = (self.map.patch(), self.map.patch().width());
        for (row, heights) in (patch.rows[0]..).zip(self.map.drop_m().chunks_exact(width.max(1))) {
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
            self.touched.include(Patch {
                rows: [row, row + 1],
                cols: [patch.cols[0] + first, patch.cols[0] + last + 1],
            });
        }
    }
}
