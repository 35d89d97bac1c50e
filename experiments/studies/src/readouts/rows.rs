//! Readouts whose rows are the same in every frame: a scan, Walsh functions, and few rows of signs.

use super::decode::{FewRows, WHOLE_IMAGES};
use super::wire::WireSession;
use super::{Reading, ReadoutSkin, WireReadout, until_noticed};
use spts_circuit::{CellCodes, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::rows::{DesignRows as _, Expected, RowTask, Separable, Tolerances};

/// A raster scan of a sheet of so many columns: measurement k is taxel k, and the image is the samples of the contacts.
pub(super) struct Raster {
    pub(super) cols: usize,
}

impl WireReadout for Raster {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        conductance_s.iter().copied().fold(0.0, f64::max)
    }

    fn read(&self, wire: &mut WireSession<'_>) -> Result<Vec<Reading>, Refusal> {
        let frame = wire.scan()?;
        let beyond: Vec<bool> = frame.volts.iter().map(|v| *v > frame.alarm_v).collect();
        // the taxel whose sample is beyond the alarm is the place
        let noticed = until_noticed(&beyond);
        Ok(vec![Reading {
            measurements: frame.volts.len(),
            image: frame.contacts(self.cols),
            noticed,
            placed: noticed,
        }])
    }
}

/// Walsh functions, computed by counting: at row r, taxel k has the weight (−1)^(number of ones of r and k). They
/// repeat after the next power of two of the number of taxels; no row is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct WalshRows {
    taxels: usize,
}

impl WalshRows {
    /// Number of rows before they repeat: the smallest power of two that is at least the number of taxels.
    fn rows(self) -> usize {
        self.taxels.next_power_of_two()
    }

    /// The noiseless sample of every row: Σ wₖ·valuesₖ over the taxels, with one value a taxel, by the fast Walsh
    /// transform. Applied to its own result, divided by the number of rows, it gives the values back.
    fn transform(self, values: &[f64]) -> Vec<f64> {
        let mut sums = values.to_vec();
        sums.resize(self.rows(), 0.0);
        let mut half = 1;
        while half < sums.len() {
            for pair in sums.chunks_exact_mut(2 * half) {
                let (low, high) = pair.split_at_mut(half);
                for (a, b) in low.iter_mut().zip(high) {
                    (*a, *b) = (*a + *b, *a - *b);
                }
            }
            half *= 2;
        }
        sums
    }
}

impl CellCodes for WalshRows {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            let row = row % self.rows() as u64;
            for (k, out) in (0..).zip(out) {
                let even = (row & k).count_ones().is_multiple_of(2);
                *out = if even { u8::MAX } else { 0 };
            }
        }
        Ok(())
    }
}

/// Code division: all `taxels` at once, taxel k with the k-th Walsh function as its code, and each one correlated with
/// its code: as many chips as the next power of two holds. Nothing is known of the images.
pub(super) struct CodeDivision {
    pub(super) taxels: usize,
}

impl WireReadout for CodeDivision {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let walsh = WalshRows { taxels: self.taxels };
        let sums = walsh.transform(conductance_s);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut WireSession<'_>) -> Result<Vec<Reading>, Refusal> {
        let [low, high] = wire.levels;
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let walsh = WalshRows { taxels: self.taxels };
        let chips = walsh.rows();
        let frame = wire.signs(&walsh, chips)?;
        // y = middle · Σx + half · H x, and row 0 of H is all ones
        let sum = frame.volts.first().map_or(0.0, |first| first / (middle + half));
        let plain: Vec<f64> = frame.volts.iter().map(|v| (v - middle * sum) / half).collect();
        let mut image = walsh.transform(&plain);
        image.truncate(self.taxels);
        image.iter_mut().for_each(|v| *v = (*v / chips as f64).max(0.0));
        Ok(vec![Reading {
            measurements: chips,
            image,
            noticed: frame.noticed(chips),
            placed: Some(chips as f64 - 0.5),
        }])
    }
}

/// The published cells' own rows: pseudorandom ±1 from mixed seeds, the first M of them over and over.
pub(super) fn random_signs(skin: &ReadoutSkin) -> Result<FewRows, Refusal> {
    let (most, taxels) = (skin.most_measurements(), skin.layout.taxels());
    let count = u32::try_from(taxels).unwrap_or(u32::MAX);
    let mut signs = vec![0.0; most * taxels];
    Weights::new(WeightMode::Binary, Seeding::Mixed, count).fill_rows(0, &mut signs);
    FewRows::new(skin, Matrix::from_rows(most, taxels, signs)?, None)
}

/// Distance over which images of larger skins are alike, taxels.
const SMOOTH_TAXELS: f64 = 1.5;

/// Rows of ±1 in pattern mode: products of two rows along the axes of the skin. Each of the two lowers what is left of
/// the expected images' variance most. They make the best images of docs/rows.md.
pub(super) fn designed_signs(skin: &ReadoutSkin) -> Result<FewRows, Refusal> {
    let shape = [skin.layout.rows(), skin.layout.cols()];
    let expected = if skin.layout.taxels() <= WHOLE_IMAGES {
        Expected::like(&*skin.prior()?, shape, Tolerances::default())?
    } else {
        Expected::smooth(shape, SMOOTH_TAXELS)?
    };
    let designed = Separable.design(&RowTask::new(skin.most_measurements(), &expected))?;
    let signs = designed.view().values().iter();
    let signs = signs.map(|level| if *level > 0.0 { 1.0 } else { -1.0 }).collect();
    let signs = Matrix::from_rows(designed.nrows(), designed.ncols(), signs)?;
    FewRows::new(skin, signs, Some(SMOOTH_TAXELS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::check_codes;

    /// The fast transform against the codes themselves, and back.
    #[test]
    fn the_transform_sums_what_the_cells_put_out() {
        check_codes(&|| Box::new(WalshRows { taxels: 11 }));
        let mut walsh = WalshRows { taxels: 11 };
        let values: Vec<f64> = (0..11).map(|k| f64::from(k * k % 7)).collect();
        let sums = walsh.transform(&values);
        let mut codes = vec![0; 16 * 11];
        walsh.codes(0, &mut codes).unwrap();
        for (codes, sum) in codes.chunks(11).zip(&sums) {
            let expected: f64 = codes.iter().zip(&values).map(|(c, v)| if *c == 255 { *v } else { -*v }).sum();
            // whole numbers below 100
            assert!((sum - expected).abs() < 1e-12, "{sum} against {expected}");
        }
        let back = walsh.transform(&sums);
        assert!(back.iter().zip(&values).all(|(b, v)| (b / 16.0 - v).abs() < 1e-12));
    }
}
