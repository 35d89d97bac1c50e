//! Averages of the pressure on the fine grid over taxels.

use crate::field::Patch;
use spts_models::{PressureMap, SkinLayout};

/// Averages a map with several grid squares a taxel over each taxel, once over its whole area and once over its
/// electrode.
///
/// ```
/// use spts_contact::TaxelBins;
/// use spts_models::SkinLayout;
///
/// let skin = SkinLayout::new(1, 1, 15e-3, 10e-3)?;
/// let mut fine_pa = vec![0.0; 9]; // 3 × 3 grid squares of 5 mm
/// fine_pa[4] = 9e3; // the middle one
/// let [taxel, electrode] = TaxelBins::new(&skin, 3).means(&fine_pa, None);
/// assert!((taxel.values()[0] - 1e3).abs() < 1e-9);
/// assert!((electrode.values()[0] - 2.25e3).abs() < 1e-9, "the electrode is 10 mm wide");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct TaxelBins {
    rows: usize,
    cols: usize,
    cells: usize,
    /// Share of the electrode's side in each fine cell along one axis; the sum is 1.
    electrode_weights: Vec<f64>,
}

impl TaxelBins {
    /// Averages of maps with `cells_per_taxel` grid squares along each side of a taxel of `skin`.
    pub fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let low_m = 0.5 * (skin.pitch_m() - skin.electrode_m());
        let high_m = low_m + skin.electrode_m();
        let electrode_weights = (0..cells_per_taxel)
            .map(|i| {
                let start_m = i as f64 * cell_m;
                ((start_m + cell_m).min(high_m) - start_m.max(low_m)).max(0.0) / skin.electrode_m()
            })
            .collect();
        Self { rows: skin.rows(), cols: skin.cols(), cells: cells_per_taxel, electrode_weights }
    }

    /// Means of the map `fine`: over each taxel's whole area (the sum of these × pitch² is the normal force), and over
    /// its electrode. Grid squares cut by the electrode's border count with the area inside.
    ///
    /// If the map is 0 outside `patch`, only the patch is read; the result has the same bits.
    ///
    /// # Panics
    /// If `fine` does not have `(rows · cells) × (cols · cells)` values, or `patch` is not inside the map.
    pub fn means(&self, fine: &[f64], patch: Option<Patch>) -> [PressureMap; 2] {
        let mut maps = [(); 2].map(|()| PressureMap::zeros(self.rows, self.cols));
        self.add(fine, patch.unwrap_or_else(|| self.whole()), maps.each_mut());
        maps
    }

    /// Adds the means of the map `fine`, which is 0 outside `patch`, to `maps`.
    pub(crate) fn add(&self, fine: &[f64], patch: Patch, maps: [&mut PressureMap; 2]) {
        let width = self.cols * self.cells;
        assert_eq!(fine.len(), self.rows * self.cells * width, "fine field of the wrong shape");
        if patch.is_empty() {
            return;
        }
        let share = 1.0 / self.cells as f64;
        let taxels = patch.cols[0] / self.cells..patch.cols[1].div_ceil(self.cells);
        let [cell_means, electrode_means] = maps;
        for y in patch.rows[0]..patch.rows[1] {
            let line = &fine[y * width..(y + 1) * width];
            let electrode_line = self.electrode_weights[y % self.cells];
            let first = y / self.cells * self.cols;
            for x in taxels.clone() {
                let block = &line[x * self.cells..(x + 1) * self.cells];
                let sum: f64 = block.iter().map(|p| share * p).sum();
                cell_means.values_mut()[first + x] += share * sum;
                let sum: f64 = block.iter().zip(&self.electrode_weights).map(|(p, w)| w * p).sum();
                electrode_means.values_mut()[first + x] += electrode_line * sum;
            }
        }
    }

    /// The taxels that `patch` has a part of.
    pub(crate) fn taxels(&self, patch: Patch) -> impl Iterator<Item = usize> + use<> {
        let along = |cells: [usize; 2]| cells[0] / self.cells..cells[1].div_ceil(self.cells);
        let (rows, cols, width) = (along(patch.rows), along(patch.cols), self.cols);
        rows.flat_map(move |row| cols.clone().map(move |col| row * width + col))
    }

    fn whole(&self) -> Patch {
        Patch { rows: [0, self.rows * self.cells], cols: [0, self.cols * self.cells] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Round-off of a few hundred additions of positive numbers.
    const ROUND_OFF: f64 = 1e-13;

    #[test]
    fn uniform_field_keeps_its_value() {
        for cells in [1, 2, 3, 6, 7] {
            let bins = TaxelBins::new(&SkinLayout::default(), cells);
            let fine = vec![3.0; 100 * cells * cells];
            for map in bins.means(&fine, None) {
                for value in map.values() {
                    assert_relative_eq!(*value, 3.0, max_relative = ROUND_OFF);
                }
            }
        }
    }

    /// A patch around everything that is not 0 gives the bits of the whole field, whether or not it cuts taxels.
    #[test]
    fn patch_is_enough() {
        let skin = SkinLayout::new(4, 5, 15e-3, 10e-3).unwrap();
        let bins = TaxelBins::new(&skin, 3);
        let patch = Patch { rows: [2, 8], cols: [4, 11] };
        let mut fine = vec![0.0; 12 * 15];
        for (row, line) in (2_u32..).zip(patch.lines(15)) {
            for (col, p) in (4_u32..).zip(&mut fine[line]) {
                *p = f64::from(row * row + 3 * col).sin().abs();
            }
        }
        let means = bins.means(&fine, Some(patch));
        assert_eq!(means, bins.means(&fine, None));
        assert!(means[0].sum() > 0.0);
        assert!(bins.means(&fine, Some(Patch::default()))[0].sum() <= 0.0);
    }

    /// 15 mm pitch in 6 cells of 2.5 mm; a 6 mm electrode spans 4.5–10.5 mm: cells 2 and 3 whole, 0.5 mm of cells 1
    /// and 4. A load on cell 1 of both axes weighs (0.5/6)².
    #[test]
    fn electrode_cuts_cells() {
        let skin = SkinLayout::new(1, 1, 15e-3, 6e-3).unwrap();
        let bins = TaxelBins::new(&skin, 6);
        let mut fine = vec![0.0; 36];
        fine[6 + 1] = 1.0;
        let [cell, electrode] = bins.means(&fine, None).map(|map| map.values()[0]);
        assert_relative_eq!(electrode, (0.5_f64 / 6.0).powi(2), max_relative = 1e-12);
        assert_relative_eq!(cell, 1.0 / 36.0, max_relative = ROUND_OFF);
    }
}
