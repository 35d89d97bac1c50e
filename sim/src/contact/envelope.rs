//! Lower envelope of a posed triangle mesh on the skin's fine grid.

use super::PosedMesh;
use super::envelope_map::{HeightMap, Stand, ToCells, height_m, stand};
use super::envelope_raster::{Cells, Patch, Raster, least};
use spts_models::SkinLayout;

/// Depth below the skin's free surface, sampled at the centres of fine cells: the deepest point of the mesh above each
/// centre, exact for the triangle mesh. Holes and concave undersides need no special care.
///
/// Heights are taken relative to the body's origin and its own height is added last. A body that comes again with the
/// same rotation and place (bit for bit) therefore gets the very same depths from a map kept of it, which is made at the
/// second call.
#[derive(Debug, Clone)]
pub struct Envelope {
    raster: Raster,
    depth_m: Vec<f64>,
    /// Height of every vertex of the last mesh above the body's origin.
    height_m: Vec<f64>,
    touched: Patch,
    /// Where the last body stood.
    stand: Stand,
    map: HeightMap,
}

/// Least height above the present level to which a map is made, m. It is doubled with the depth, so that a body that
/// sinks step by step has its map made again a few times only.
const REACH_M: f64 = 1e-3;

impl Envelope {
    /// Empty envelope over `skin`, `cells_per_taxel` cells along each side of a taxel.
    #[must_use]
    pub fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let raster = Raster::new(skin, cells_per_taxel);
        Self {
            depth_m: vec![0.0; raster.rows * raster.cols],
            raster,
            height_m: Vec::new(),
            touched: Patch::default(),
            stand: Stand::default(),
            map: HeightMap::default(),
        }
    }

    /// Number of fine rows and columns.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        [self.raster.rows, self.raster.cols]
    }

    /// Side of a fine cell, m.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.raster.cell_m
    }

    /// Centre (x, y) of a fine cell, m.
    #[must_use]
    pub fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        self.raster.centre_m(row, col)
    }

    /// Depth below the free surface, m, row-major; 0 where nothing dips below it.
    #[must_use]
    pub fn depth_m(&self) -> &[f64] {
        &self.depth_m
    }

    /// Rasterises the parts of `body` below z = 0 and returns the cells that may have a depth. Only the cells of the
    /// previous call are cleared. Allocates only when a mesh has more vertices than any before it, and when a map is
    /// made.
    pub fn rasterise(&mut self, body: &PosedMesh<'_>) -> Patch {
        for line in self.touched.lines(self.raster.cols) {
            self.depth_m[line].fill(0.0);
        }
        self.touched = Patch::default();
        let (level_m, stand) = (-body.position_m[2], stand(body));
        let again = self.stand == stand;
        if again && self.map.serves(body, &stand, level_m) {
            self.lower(level_m);
            return self.touched;
        }
        self.stand = stand;
        let lowest_m = self.find_heights(body);
        if lowest_m < level_m {
            if again {
                let reach_m = level_m + (level_m - lowest_m).max(REACH_M);
                self.map = HeightMap::build(&self.raster, body, &self.height_m, reach_m);
                self.lower(level_m);
            } else {
                self.add_below(body, level_m);
            }
        }
        self.touched
    }

    /// Map of the whole underside of `body`, whatever its height.
    pub(super) fn height_map(&mut self, body: &PosedMesh<'_>) -> &HeightMap {
        if !self.map.serves(body, &stand(body), f64::INFINITY) {
            self.find_heights(body);
            self.map = HeightMap::build(&self.raster, body, &self.height_m, f64::INFINITY);
        }
        &self.map
    }

    /// Notes the height of every vertex above the body's origin and returns the least, m.
    fn find_heights(&mut self, body: &PosedMesh<'_>) -> f64 {
        let [_, _, up] = body.rotation;
        self.height_m.clear();
        self.height_m.extend(body.mesh.vertices.iter().map(|v| height_m(up, v)));
        // four at a time: a single chain of minima would wait for itself
        let mut least = [f64::INFINITY; 4];
        let (chunks, rest) = self.height_m.as_chunks::<4>();
        for chunk in chunks {
            for (low, &z) in least.iter_mut().zip(chunk) {
                *low = if z < *low { z } else { *low };
            }
        }
        least.iter().chain(rest).copied().fold(f64::INFINITY, f64::min)
    }

    /// Adds every triangle that dips below `level_m` above the origin.
    fn add_below(&mut self, body: &PosedMesh<'_>, level_m: f64) {
        let mut cells = Cells {
            values: &mut self.depth_m,
            origin: [0, 0],
            stride: self.raster.cols,
            level_m,
        };
        let to_cells = ToCells::new(&self.raster, body);
        let (vertices, height_m) = (&body.mesh.vertices[..], &self.height_m[..]);
        for &[i, j, k] in &body.mesh.triangles {
            let (i, j, k) = (i as usize, j as usize, k as usize);
            let (a, b, c) = (height_m[i], height_m[j], height_m[k]);
            if least([a, b, c]) < level_m {
                let a = to_cells.corner(vertices[i], a);
                let b = to_cells.corner(vertices[j], b);
                let c = to_cells.corner(vertices[k], c);
                if let Some(patch) = self.raster.add(&mut cells, [a, b, c]) {
                    self.touched.include(patch);
                }
            }
        }
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
