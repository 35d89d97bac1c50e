//! Consecutive rows of the weight matrix, computed without storing the matrix.

use crate::code_rows::CodeRows;
use crate::codes::{CellCodes, CodesError};
use crate::kernels::{Jumps, LANES, Lines, Sums, analog_sums, signed_sums, signed_sums_2};
use crate::lcg::Jump;
use crate::mode::{ANALOG_SCALE, WeightMode};
use crate::weights::Weights;
use std::convert::Infallible;

/// Rows that [`Weights::weighted_sums`] sums at a time.
const RUN: usize = 128;

/// A run of rows: one jump from the seeds a row, so that any level of it is two operations away; or codes that are
/// given.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    weights: Weights,
    first_row: u64,
    /// Codes of the cells, if they are given or form a pattern.
    given: Option<Box<CodeRows>>,
    /// Whether raster mode also computes sums: given codes may drive any number of taxels.
    summed: bool,
    /// Jump to the row before the first; `None` before the first edge.
    before: Option<Jump>,
    jumps: Jumps,
}

impl Rows {
    /// No rows yet.
    pub(crate) fn new(weights: Weights) -> Self {
        Self {
            weights,
            first_row: 0,
            given: None,
            summed: false,
            before: None,
            jumps: Jumps::default(),
        }
    }

    /// Goes to the rows `first_row..first_row + len` of `source`, in place of the generator's.
    ///
    /// # Errors
    /// Those of the source.
    pub(crate) fn go_to_codes(
        &mut self,
        source: &mut dyn CellCodes,
        first_row: u64,
        len: usize,
    ) -> Result<(), CodesError> {
        let (mode, taxels) = (self.weights.mode(), self.weights.taxels());
        let given = self.given.get_or_insert_with(|| Box::new(CodeRows::new(mode, taxels)));
        (self.first_row, self.summed) = (first_row, true);
        given.go_to(first_row, len, |row, codes| source.codes(row, codes))
    }

    /// Goes to the rows `first_row..first_row + len`.
    pub(crate) fn go_to(&mut self, first_row: u64, len: usize) {
        self.first_row = first_row;
        if let Some(patterns) = self.weights.patterns() {
            let (mode, taxels) = (self.weights.mode(), self.weights.taxels());
            let given = self.given.get_or_insert_with(|| Box::new(CodeRows::new(mode, taxels)));
            let Ok(()) = given.go_to(first_row, len, |row, codes| {
                patterns.fill(row, codes);
                Ok::<(), Infallible>(())
            });
            return;
        }
        if self.weights.mode() == WeightMode::Raster {
            return;
        }
        let before = Jump::new(first_row);
        self.before = (first_row > 0).then_some(before);
        self.jumps.go_to(before.then(Jump::ONE), len.next_multiple_of(LANES));
    }

    /// Weights that these are rows of.
    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Row of the first measurement.
    pub(crate) fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Measurements with levels that sound cells in this mode do not have together, as only cells from outside may.
    pub(crate) fn odd(&self) -> impl Iterator<Item = usize> {
        self.given.iter().flat_map(|given| given.odd())
    }

    /// Taxel that measurement `i` of a raster scans.
    fn scanned(&self, i: usize) -> usize {
        let taxel = (self.first_row + i as u64) % self.weights.taxels().max(1) as u64;
        usize::try_from(taxel).unwrap_or(usize::MAX)
    }

    /// Seed of `taxel`; only the generator's rows ask for it.
    #[inline]
    fn seed(&self, taxel: usize) -> u32 {
        self.weights.seeds().map_or(0, |seeds| seeds.seed(taxel))
    }

    /// Level of `taxel` at measurement `i`.
    #[inline]
    pub(crate) fn level(&self, taxel: usize, i: usize) -> f64 {
        if let Some(given) = &self.given {
            return given.level(taxel, i);
        }
        if self.weights.mode() == WeightMode::Raster {
            return f64::from(self.scanned(i) == taxel);
        }
        let state = self.jumps.state(self.seed(taxel), i);
        self.weights.mode().level(state)
    }

    /// Whether the levels are given by codes of the cells, and not by the weights.
    pub(crate) fn are_given(&self) -> bool {
        self.given.is_some()
    }

    /// Level of `taxel` at the measurement before measurement `i`; 0 before the first edge of all.
    #[inline]
    pub(crate) fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        if let Some(given) = &self.given {
            return given.previous_level(taxel, i);
        }
        if i > 0 {
            return self.level(taxel, i - 1);
        }
        if self.weights.mode() == WeightMode::Raster {
            let before = self.first_row.checked_sub(1);
            let scanned = before.and_then(|row| row.checked_rem(self.weights.taxels() as u64));
            return f64::from(scanned == Some(taxel as u64));
        }
        self.before
            .map_or(0.0, |jump| self.weights.mode().level(jump.apply(self.seed(taxel))))
    }

    /// Sums over the taxels with values on `lines`, into `sums`, whose old content is dropped. In raster mode the
    /// generator's rows have no sums.
    pub(crate) fn sum(&self, lines: Lines<'_>, sums: &mut Sums) {
        let len = self.given.as_ref().map_or(self.jumps.len(), |given| given.padded_len());
        let clear = |sum: &mut Vec<f64>| {
            sum.clear();
            sum.resize(len, 0.0);
        };
        clear(&mut sums.from);
        if let Some(given) = &self.given {
            clear(&mut sums.to);
            clear(&mut sums.squares);
            return given.sum(lines, sums);
        }
        let Some(seeds) = self.weights.seeds() else { return };
        match (self.weights.mode(), lines.to) {
            (WeightMode::Raster, _) => {}
            (WeightMode::Binary, Some(to)) => {
                clear(&mut sums.to);
                signed_sums_2(&self.jumps, seeds, [lines.from, to], [&mut sums.from, &mut sums.to]);
            }
            (WeightMode::Binary, None) => signed_sums(&self.jumps, seeds, lines.from, &mut sums.from),
            (WeightMode::Analog, _) => {
                clear(&mut sums.squares);
                analog_sums(&self.jumps, seeds, lines, &mut sums.from, &mut sums.squares);
            }
        }
    }

    /// Σ wₖ·xₖ at measurement `i`, from the `sums` of the same `lines`.
    #[inline(always)]
    pub(crate) fn weighted(&self, lines: &Lines<'_>, sums: &Sums, i: usize) -> f64 {
        match self.weights.mode() {
            WeightMode::Raster if self.summed => sums.from[i],
            WeightMode::Raster => lines.at(self.scanned(i), i),
            WeightMode::Binary => lines.between(i, sums.from[i], || lines.to.map(|_| sums.to[i])),
            WeightMode::Analog => sums.from[i] / ANALOG_SCALE,
        }
    }

    /// √Σ(wₖ·xₖ)² of the [`odd`](Self::odd) measurements.
    pub(crate) fn odd_norms(&self, lines: &Lines<'_>) -> impl Iterator<Item = (usize, f64)> {
        let given = self.given.iter();
        given.flat_map(move |given| given.odd().map(move |i| (i, given.norm(lines, i))))
    }
}

impl Weights {
    /// Σₖ wₖ·valuesₖ at consecutive rows from `first_row` on, one for each entry of `out`; the matrix is never stored.
    /// The sums have the same bits on every machine, and for any division of the rows among calls.
    ///
    /// # Panics
    /// If `values` does not have one entry a taxel.
    pub fn weighted_sums(&self, first_row: u64, values: &[f64], out: &mut [f64]) {
        assert_eq!(values.len(), self.taxels(), "one value a taxel");
        if values.is_empty() {
            out.fill(0.0);
            return;
        }
        let (mut rows, mut sums) = (Rows::new(self.clone()), Sums::default());
        for (out, first_row) in out.chunks_mut(RUN).zip((first_row..).step_by(RUN)) {
            rows.go_to(first_row, out.len());
            let lines = Lines {
                from: values,
                to: None,
                share: &[0.0; RUN],
            };
            rows.sum(lines, &mut sums);
            for (i, out) in out.iter_mut().enumerate() {
                *out = rows.weighted(&lines, &sums, i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::Seeding;

    /// Against the rows themselves; two orders of n additions of values below 10 differ by less than n roundings of
    /// 10·n.
    #[test]
    fn sums_are_the_rows_times_the_values() {
        for taxels in [1_u32, 5, 64, 100, 131] {
            let n = taxels as usize;
            let values: Vec<f64> = (0..n).map(|k| (0.7 * k as f64).sin() * 10.0).collect();
            for mode in [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary] {
                for seeding in [Seeding::Address, Seeding::Mixed] {
                    let weights = Weights::new(mode, seeding, taxels);
                    let (mut rows, mut sums) = (vec![0.0; 300 * n], vec![0.0; 300]);
                    weights.fill_rows(77, &mut rows);
                    weights.weighted_sums(77, &values, &mut sums);
                    for (row, sum) in rows.chunks(n).zip(&sums) {
                        let expected: f64 = row.iter().zip(&values).map(|(w, v)| w * v).sum();
                        let tolerance = (n * n) as f64 * 10.0 * f64::EPSILON;
                        assert!((sum - expected).abs() <= tolerance, "{sum} V, expected {expected} V");
                    }
                    let mut again = vec![0.0; 300];
                    for (i, out) in again.chunks_mut(7).enumerate() {
                        weights.weighted_sums(77 + 7 * i as u64, &values, out);
                    }
                    assert!(sums == again, "the cut shows: {mode:?}, {seeding:?}, {taxels} taxels");
                }
            }
        }
    }
}
