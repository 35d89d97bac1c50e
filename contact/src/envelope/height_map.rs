//! The height map of a pose, kept while the body only moves vertically.

use super::blocks::Blocks;
use super::raster::{Cells, Raster};
use crate::body::PosedMesh;
use crate::patch::Patch;

/// Rotation and place of a body, bit for bit: everything of a pose but its height.
pub(super) type Stand = [u64; 11];

pub(super) fn stand(body: &PosedMesh<'_>) -> Stand {
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
    pub(super) fn serves(&self, stand: &Stand, level_m: f64) -> bool {
        level_m <= self.reach_m && self.stand == *stand
    }

    /// Makes it the map of `body`, whose mesh is in `blocks`, below `reach_m` above its origin.
    pub(super) fn make(&mut self, raster: &Raster, blocks: &mut Blocks, body: &PosedMesh<'_>, reach_m: f64) {
        (self.stand, self.reach_m, self.patch) = (stand(body), reach_m, Patch::default());
        self.triangles.clear();
        blocks.below(raster, body, reach_m, |corners| {
            if let Some(span) = raster.span(corners) {
                self.patch.include(span);
                self.triangles.push((span, corners));
            }
        });
        self.drop_m.clear();
        self.drop_m
            .resize(self.patch.height() * self.patch.width(), f64::NEG_INFINITY);
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
