//! Entrants whose rows are the same for every answer: a scan, Walsh functions, frequencies along rows and columns, and
//! rows of ±1 with a decoder.

use super::wire::{NEUTRAL, WireSession};
use super::{Entrant, Reader, Reading};
use spts_circuit::{CellCodes, Patterns, WeightRows, Weights};
use spts_eval::decoders::TrainedDecoder;
use spts_eval::{Press, PressRows, Scorer};
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::operator::LinearOperator as _;
use std::collections::BTreeMap;
use std::sync::Arc;

/// One taxel after another at level 1, all others neutral.
#[derive(Clone)]
pub(super) struct OneByOne {
    pub(super) taxels: usize,
}

impl CellCodes for OneByOne {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        out.fill(NEUTRAL);
        for (row, codes) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            #[expect(clippy::cast_possible_truncation, reason = "less than the number of taxels")]
            let taxel = (row % self.taxels as u64) as usize;
            codes[taxel] = u8::MAX;
        }
        Ok(())
    }
}

/// A raster scan of a sheet of so many columns, from the first taxel on: a taxel that there was no time for is 0.
pub(super) struct Raster {
    pub(super) taxels: usize,
    pub(super) cols: usize,
}

impl Entrant for Raster {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        conductance_s.iter().copied().fold(0.0, f64::max)
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &Raster {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let mut frame = wire.scan(self.taxels.min(wire.left()))?;
        frame.volts.resize(self.taxels, 0.0);
        Ok(Reading::of(frame.contacts(self.cols)))
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

impl Entrant for CodeDivision {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        largest(&WalshRows { taxels: self.taxels }.transform(conductance_s))
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &CodeDivision {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let walsh = WalshRows { taxels: self.taxels };
        let chips = walsh.rows();
        let count = chips.min(wire.left());
        let mut volts = wire.signs(count, &walsh, count)?.volts;
        volts.resize(chips, 0.0);
        let mut image = walsh.transform(&volts);
        image.truncate(self.taxels);
        image.iter_mut().for_each(|v| *v = v.max(0.0));
        Ok(Reading::of(image))
    }
}

/// Frequency division by rows and columns: the cells of a row of the sheet share a square wave, then those of a column.
/// The waves are Walsh functions, so that the sums of the rows and of the columns come apart; a taxel is taken for the
/// product of its two sums.
#[derive(Clone)]
pub(super) struct FrequencyDivision {
    pub(super) rows: usize,
    pub(super) cols: usize,
}

impl FrequencyDivision {
    /// Chips for the rows, and for the columns.
    fn chips(&self) -> [usize; 2] {
        [self.rows, self.cols].map(usize::next_power_of_two)
    }

    fn level(&self, row: usize, taxel: usize) -> f64 {
        let [first, all] = [self.chips()[0], self.chips().iter().sum()];
        let row = row % all;
        let (chip, line) = if row < first { (row, taxel / self.cols) } else { (row - first, taxel % self.cols) };
        if (chip & line).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
    }
}

impl CellCodes for FrequencyDivision {
    fn taxels(&self) -> usize {
        self.rows * self.cols
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        let (taxels, all) = (self.rows * self.cols, self.chips().iter().sum::<usize>() as u64);
        for (row, codes) in (first_row..).zip(out.chunks_exact_mut(taxels)) {
            #[expect(clippy::cast_possible_truncation, reason = "less than the number of chips")]
            let row = (row % all) as usize;
            for (taxel, code) in codes.iter_mut().enumerate() {
                *code = if self.level(row, taxel) > 0.0 { u8::MAX } else { 0 };
            }
        }
        Ok(())
    }
}

impl Entrant for FrequencyDivision {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        // its first row adds up all taxels
        conductance_s.iter().sum()
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &FrequencyDivision {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let [first, second] = self.chips();
        let count = (first + second).min(wire.left());
        let mut volts = wire.signs(count, *self, count)?.volts;
        volts.resize(first + second, 0.0);
        let (rows, cols) = volts.split_at(first);
        let rows = WalshRows { taxels: self.rows }.transform(rows);
        let cols = WalshRows { taxels: self.cols }.transform(cols);
        let taxel = |k: usize| rows[k / self.cols].max(0.0) * cols[k % self.cols].max(0.0);
        Ok(Reading::of((0..self.rows * self.cols).map(taxel).collect()))
    }
}

fn largest(sums: &[f64]) -> f64 {
    sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
}

/// Rows of ±1 for every number of measurements, and a decoder.
pub(super) struct RowsAndDecoder {
    rows: BTreeMap<usize, Rows>,
    decoder: TrainedDecoder,
    in_turn: bool,
}

/// Rows as numbers, as a decoder gets them, and as the cells put them out.
struct Rows {
    levels: Matrix,
    shared: Arc<PressRows>,
    cells: Cells,
}

enum Cells {
    Given(Weights),
    Own(Patterns),
}

impl RowsAndDecoder {
    /// With these `rows`, M × taxels, ±1, one matrix for every number of measurements M.
    ///
    /// # Errors
    /// [`Refusal`] for rows that are not ±1.
    pub(super) fn new(rows: Vec<Matrix>, decoder: TrainedDecoder) -> Result<Self, Refusal> {
        let each = rows.into_iter().map(|levels| {
            let values = levels.view().values();
            if let Some(level) = values.iter().find(|level| ![-1.0, 1.0].contains(*level)) {
                return Err(Refusal::range("rows", level, "{-1, 1}"));
            }
            let cells = Cells::Own(Patterns::of_levels(levels.nrows(), values)?);
            Ok((levels.nrows(), Rows { shared: Arc::new(PressRows::of_matrix(&levels)), levels, cells }))
        });
        Ok(Self { rows: each.collect::<Result<_, Refusal>>()?, decoder, in_turn: false })
    }

    /// With the first rows of `weights`, which may have several wires, for each of `measurements`.
    ///
    /// # Errors
    /// None for weights of ±1.
    pub(super) fn given(weights: &Weights, measurements: &[usize], decoder: TrainedDecoder) -> Result<Self, Refusal> {
        let each = measurements.iter().map(|&m| {
            let rows = WeightRows::new(weights, 0, m);
            let levels = Matrix::from_rows(m, weights.taxels(), rows.to_vec())?;
            Ok((m, Rows { levels, shared: Arc::new(PressRows::new(rows)), cells: Cells::Given(weights.clone()) }))
        });
        Ok(Self { rows: each.collect::<Result<_, Refusal>>()?, decoder, in_turn: false })
    }

    /// The same, asked by one thread after the other.
    pub(super) fn in_turn(self) -> Self {
        Self { in_turn: true, ..self }
    }
}

impl Entrant for RowsAndDecoder {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let of = |rows: &Matrix| {
            let mut sums = vec![0.0; rows.nrows()];
            rows.apply(conductance_s, &mut sums);
            largest(&sums)
        };
        self.rows.values().map(|rows| of(&rows.levels)).fold(0.0, f64::max)
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(Decoding { entrant: self, scorer: Scorer::new(&self.decoder) })
    }

    fn in_turn(&self) -> bool {
        self.in_turn
    }

    fn finish(&self) -> Result<(), Refusal> {
        self.decoder.finish()
    }
}

struct Decoding<'a> {
    entrant: &'a RowsAndDecoder,
    scorer: Scorer<'a>,
}

impl Reader for Decoding<'_> {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let count = wire.left();
        let rows = self.entrant.rows.get(&count).ok_or_else(|| Refusal::new(format!("{count} rows")))?;
        let frame = match &rows.cells {
            Cells::Given(weights) => wire.given(count, weights, count)?,
            Cells::Own(patterns) => wire.signs(count, patterns, count)?,
        };
        let press = Press::on(Arc::clone(&rows.shared), frame.volts, 0.0);
        let window = press.window(0, count).ok_or_else(|| Refusal::new("a sample was lost"))?;
        let began = std::time::Instant::now();
        let answer = self.scorer.answers(std::slice::from_ref(&window))?.into_iter().next().unwrap_or_default();
        let time_s = began.elapsed().as_secs_f64();
        Ok(Reading { image: answer.image, class: answer.class, time_s })
    }
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

    /// The waves of rows and columns tell their sums.
    #[test]
    fn frequencies_tell_rows_and_columns() {
        let division = FrequencyDivision { rows: 3, cols: 5 };
        check_codes(&|| Box::new(FrequencyDivision { rows: 3, cols: 5 }));
        let values: Vec<f64> = (0..15).map(|k| f64::from(k % 4)).collect();
        let sum = |row: usize| (0..15).map(|k| division.level(row, k) * values[k]).sum::<f64>();
        let rows = WalshRows { taxels: 3 }.transform(&(0..4).map(sum).collect::<Vec<f64>>());
        let cols = WalshRows { taxels: 5 }.transform(&(4..12).map(sum).collect::<Vec<f64>>());
        // whole numbers below 100
        assert!((rows[1] / 4.0 - values[5..10].iter().sum::<f64>()).abs() < 1e-12);
        assert!((cols[2] / 8.0 - (values[2] + values[7] + values[12])).abs() < 1e-12);
    }
}
