//! Outputs of cells that replace those of their generators.

use super::decode::{FewRows, Rows, WHOLE_IMAGES};
use super::wire::HeldWire;
use super::{PreparedReadout, Reading, ReadoutSkin, WireReadout, until_noticed};
use spts_circuit::{CellCodes, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_recon::rows::{DesignRows as _, Expected, RowTask, Separable, Tolerances};
use std::sync::Arc;

/// DAC codes of the levels −1, 0 and +1.
const CODES: [u8; 3] = [0, 126, 255];

/// Code of a level −1, 0 or +1.
fn code(level: i8) -> u8 {
    match level {
        ..0 => CODES[0],
        0 => CODES[1],
        _ => CODES[2],
    }
}

/// Row `row` mod `period`.
fn repeated(row: u64, period: usize) -> usize {
    usize::try_from(row % period.max(1) as u64).unwrap_or(0)
}

/// Stored levels, M × N, which repeat after M rows.
///
/// ```
/// use spts_studies::readouts::StoredRows;
///
/// let rows = StoredRows::new(3, vec![1, -1, 0, 1, 1, 1]);
/// assert_eq!((rows.len(), rows.taxels()), (2, 3));
/// assert_eq!(rows.sums(&[5.0, 2.0, 1.0]), [3.0, 8.0]);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRows {
    taxels: usize,
    levels: Arc<Vec<i8>>,
}

impl StoredRows {
    /// Rows of `levels` (−1, 0 or +1, row-major) for `taxels` taxels.
    ///
    /// # Panics
    /// If the levels are not a whole number of rows.
    #[must_use]
    pub fn new(taxels: usize, levels: Vec<i8>) -> Self {
        assert!(
            taxels > 0 && !levels.is_empty() && levels.len().is_multiple_of(taxels),
            "{} levels are not a whole number of rows of {taxels}",
            levels.len()
        );
        Self {
            taxels,
            levels: Arc::new(levels),
        }
    }

    /// Number of rows M.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.len() / self.taxels
    }

    /// Always `false`: there is at least one row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.levels.is_empty()
    }

    /// Number of taxels N.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxels
    }

    /// Levels of row `r`, one a taxel.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn row(&self, r: usize) -> &[i8] {
        &self.levels[r * self.taxels..(r + 1) * self.taxels]
    }

    /// Σ wₖ·valuesₖ for every row.
    ///
    /// # Panics
    /// If the number of values differs from that of the taxels.
    #[must_use]
    pub fn sums(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.taxels, "one value a taxel");
        let sum = |row: &[i8]| row.iter().zip(values).map(|(w, v)| f64::from(*w) * v).sum();
        self.levels.chunks_exact(self.taxels).map(sum).collect()
    }
}

impl CellCodes for StoredRows {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            let levels = self.row(repeated(row, self.len()));
            out.iter_mut().zip(levels).for_each(|(out, level)| *out = code(*level));
        }
        Ok(())
    }
}

/// Walsh functions, computed by counting: at row r, taxel k has the weight (−1)^(number of ones of r and k). They
/// repeat after the next power of two of the number of taxels; no row is stored.
///
/// ```
/// use spts_studies::readouts::WalshRows;
///
/// let walsh = WalshRows::new(4);
/// let sums = walsh.transform(&[0.0, 3.0, 0.0, 0.0]); // one pressed taxel
/// assert_eq!(sums, [3.0, -3.0, 3.0, -3.0]);
/// let image: Vec<f64> = walsh.transform(&sums).iter().map(|x| x / 4.0).collect();
/// assert_eq!(image, [0.0, 3.0, 0.0, 0.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WalshRows {
    taxels: usize,
}

impl WalshRows {
    /// Walsh functions of `taxels` taxels.
    #[must_use]
    pub fn new(taxels: usize) -> Self {
        Self { taxels }
    }

    /// Number of rows before they repeat: the smallest power of two that is at least the number of taxels.
    #[must_use]
    pub fn rows(self) -> usize {
        self.taxels.next_power_of_two()
    }

    /// The noiseless sample of every row: Σ wₖ·valuesₖ over the taxels, with one value a taxel, by the fast Walsh
    /// transform. Applied to its own result, divided by the number of rows, it gives the values back.
    #[must_use]
    pub fn transform(self, values: &[f64]) -> Vec<f64> {
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
            let row = repeated(row, self.rows());
            for (k, out) in out.iter_mut().enumerate() {
                *out = CODES[if (row & k).count_ones().is_multiple_of(2) { 2 } else { 0 }];
            }
        }
        Ok(())
    }
}

/// A raster scan: measurement k is taxel k, and the image is the samples of the contacts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Raster;

/// A scan of a sheet of so many columns.
struct Scan {
    cols: usize,
}

impl WireReadout for Raster {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        Ok(Box::new(Scan {
            cols: skin.layout.cols(),
        }))
    }
}

impl PreparedReadout for Scan {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        conductance_s.iter().copied().fold(0.0, f64::max)
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
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

/// All taxels at once, taxel k with the k-th Walsh function as its code, and each one correlated with its code: as many
/// chips as the next power of two holds. Nothing is known of the images.
#[derive(Debug, Clone, Copy)]
pub(super) struct CodeDivision;

struct Coded {
    walsh: WalshRows,
    taxels: usize,
}

impl WireReadout for CodeDivision {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        Ok(Box::new(Coded {
            walsh: WalshRows::new(taxels),
            taxels,
        }))
    }
}

impl PreparedReadout for Coded {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sums = self.walsh.transform(conductance_s);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
        let [low, high] = wire.levels();
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let chips = self.walsh.rows();
        let frame = wire.signs(&self.walsh, chips)?;
        // y = middle · Σx + half · H x, and row 0 of H is all ones
        let sum = frame.volts.first().map_or(0.0, |first| first / (middle + half));
        let plain: Vec<f64> = frame.volts.iter().map(|v| (v - middle * sum) / half).collect();
        let mut image = WalshRows::new(chips).transform(&plain);
        image.truncate(self.taxels);
        image.iter_mut().for_each(|v| *v = (*v / chips as f64).max(0.0));
        let beyond: Vec<bool> = frame.volts.iter().map(|v| v.abs() > frame.alarm_v).collect();
        Ok(vec![Reading {
            measurements: chips,
            image,
            noticed: until_noticed(&beyond),
            placed: Some(chips as f64 - 0.5),
        }])
    }
}

/// The published cells' own rows: pseudorandom ±1 from mixed seeds, the first M of them over and over.
#[derive(Debug, Clone, Copy)]
pub(super) struct RandomSigns;

impl WireReadout for RandomSigns {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        let most = skin.measurements().last().copied().unwrap_or(1);
        let count = u32::try_from(taxels).unwrap_or(u32::MAX);
        let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, count);
        let mut levels = vec![0.0; most * taxels];
        weights.fill_rows(0, &mut levels);
        let levels = levels.iter().map(|level| if *level > 0.0 { 1 } else { -1 }).collect();
        let rows = StoredRows::new(taxels, levels);
        Ok(Box::new(FewRows::new(skin, rows, Rows::Random)?))
    }
}

/// Distance over which images of larger skins are alike, taxels.
const SMOOTH_TAXELS: f64 = 1.5;

/// Rows of ±1 in pattern mode: products of two rows along the axes of the skin. Each of the two lowers what is left of
/// the expected images' variance most. They make the best images of all designers (docs/rows.md).
#[derive(Debug, Clone, Copy)]
pub(super) struct DesignedSigns;

impl WireReadout for DesignedSigns {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        let most = skin.measurements().last().copied().unwrap_or(1);
        let shape = [skin.layout.rows(), skin.layout.cols()];
        let expected = if taxels <= WHOLE_IMAGES {
            Expected::like(&*skin.prior()?, shape, Tolerances::default()).map_err(Refusal::from_error)?
        } else {
            Expected::smooth(shape, SMOOTH_TAXELS).map_err(Refusal::from_error)?
        };
        let designed = Separable
            .design(&RowTask::new(most, &expected))
            .map_err(Refusal::from_error)?;
        let signs = designed
            .view()
            .values()
            .iter()
            .map(|level| if *level > 0.0 { 1 } else { -1 });
        let rows = StoredRows::new(taxels, signs.collect());
        Ok(Box::new(FewRows::new(skin, rows, Rows::Smooth(SMOOTH_TAXELS))?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::check_codes;

    #[test]
    fn rows_are_the_same_however_they_are_asked_for() {
        let levels: Vec<i8> = (0..3 * 5).map(|k| [-1, 0, 1][(k * 7 + k / 4) % 3]).collect();
        let stored = StoredRows::new(5, levels);
        check_codes(&|| Box::new(stored.clone()));
        check_codes(&|| Box::new(WalshRows::new(11)));
    }

    /// The fast transform against the codes themselves, and back.
    #[test]
    fn the_transform_sums_what_the_cells_put_out() {
        let mut walsh = WalshRows::new(11);
        let values: Vec<f64> = (0..11).map(|k| f64::from(k * k % 7)).collect();
        let sums = walsh.transform(&values);
        let mut codes = vec![0; 16 * 11];
        walsh.codes(0, &mut codes).unwrap();
        for (codes, sum) in codes.chunks(11).zip(&sums) {
            let expected: f64 = codes
                .iter()
                .zip(&values)
                .map(|(c, v)| if *c == 255 { *v } else { -*v })
                .sum();
            // whole numbers below 100
            assert!((sum - expected).abs() < 1e-12, "{sum} against {expected}");
        }
        let back = WalshRows::new(16).transform(&sums);
        assert!(back.iter().zip(&values).all(|(b, v)| (b / 16.0 - v).abs() < 1e-12));
    }
}
