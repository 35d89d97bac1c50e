//! From the fine pressure field to one value a taxel.

use spts_models::{PressureMap, SkinLayout};

/// Averages of a fine field over each taxel's whole cell and over its electrode.
#[derive(Debug, Clone)]
pub struct TaxelBins {
    rows: usize,
    cols: usize,
    cells: usize,
    /// Share of the electrode's side that falls into each fine cell along one axis; sums to 1.
    electrode_weights: Vec<f64>,
}

impl TaxelBins {
    /// Bins for a field with `cells_per_taxel` cells along each side of a taxel of `skin`.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
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
        Self {
            rows: skin.rows(),
            cols: skin.cols(),
            cells: cells_per_taxel,
            electrode_weights,
        }
    }

    /// Mean over each taxel's whole cell. Sum × pitch² = normal force.
    ///
    /// # Panics
    /// When `fine` does not have `(rows · cells) × (cols · cells)` values.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    pub fn cell_means(&self, fine: &[f64]) -> PressureMap {
        let share = 1.0 / self.cells as f64;
        self.weighted(fine, |_| share)
    }

    /// Mean over each taxel's electrode; cells cut by its border count with the area inside.
    ///
    /// # Panics
    /// When `fine` does not have `(rows · cells) × (cols · cells)` values.
    #[must_use]
    pub fn electrode_means(&self, fine: &[f64]) -> PressureMap {
        self.weighted(fine, |i| self.electrode_weights[i])
    }

    fn weighted(&self, fine: &[f64], weight: impl Fn(usize) -> f64) -> PressureMap {
        let width = self.cols * self.cells;
        assert_eq!(
            fine.len(),
            self.rows * self.cells * width,
            "fine field of the wrong shape"
        );
        let mut map = PressureMap::zeros(self.rows, self.cols);
        for (y, line) in fine.chunks_exact(width).enumerate() {
            let line_weight = weight(y % self.cells);
            let start = y / self.cells * self.cols;
            let out = &mut map.values_mut()[start..start + self.cols];
            for (mean, block) in out.iter_mut().zip(line.chunks_exact(self.cells)) {
                let sum: f64 = block.iter().enumerate().map(|(x, p)| weight(x) * p).sum();
                *mean += line_weight * sum;
            }
        }
        map
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
            for map in [bins.cell_means(&fine), bins.electrode_means(&fine)] {
                for value in map.values() {
                    assert_relative_eq!(*value, 3.0, max_relative = ROUND_OFF);
                }
            }
        }
    }

    /// 15 mm pitch in 6 cells of 2.5 mm; a 6 mm electrode spans 4.5–10.5 mm: cells 2 and 3 whole, 0.5 mm of cells 1
    /// and 4. A load on cell 1 of both axes weighs (0.5/6)².
    #[test]
    fn electrode_cuts_cells() {
        let skin = SkinLayout::new(1, 1, 15e-3, 6e-3).unwrap();
        let bins = TaxelBins::new(&skin, 6);
        let mut fine = vec![0.0; 36];
        fine[6 + 1] = 1.0;
        let value = bins.electrode_means(&fine).values()[0];
        assert_relative_eq!(value, (0.5_f64 / 6.0).powi(2), max_relative = 1e-12);
        assert_relative_eq!(bins.cell_means(&fine).values()[0], 1.0 / 36.0, max_relative = ROUND_OFF);
    }
}
