//! Drive levels of every taxel at every measurement.

use crate::kernels::{Lines, top_bits};
use crate::lcg::Jump;
use crate::mode::{WeightMode, analog, binary};
use crate::rows::{Rows, Sums};
use serde::{Deserialize, Serialize};

/// I²C address, and so the seed, of taxel 0.
pub const FIRST_ADDRESS: u32 = 8;

/// Rows that are summed at a time.
const ROWS: usize = 128;

/// How a taxel's generator is seeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seeding {
    /// With the cell's address 8, 9, …: what the device does. Across taxels the states of one row then lie on an
    /// arithmetic progression, which makes some binary rows constant.
    #[default]
    Address,
    /// With a 32-bit non-linear mix of the address, which cures the constant rows. Not something the published
    /// firmware can do: its seed is one byte.
    Mixed,
}

impl Seeding {
    /// Seed of taxel `taxel`.
    #[must_use]
    #[inline]
    pub fn seed(self, taxel: u32) -> u32 {
        let address = FIRST_ADDRESS.wrapping_add(taxel);
        match self {
            Self::Address => address,
            Self::Mixed => finalise(address),
        }
    }
}

/// 32-bit finaliser of MurmurHash3 (A. Appleby, public domain): a bijection in which every input bit reaches every
/// output bit.
#[inline]
pub(crate) fn finalise(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Drive levels of a skin of `taxels` taxels: row `r` (0-based, counted in clock edges since the seeds were loaded) holds
/// the level of every taxel at measurement `r`.
///
/// A level is the drive over its full scale. The DAC code k drives (k − 127.5)/127.5, so that codes 0 and 255 are −1 and
/// +1 and the analog levels lie between; the raster's neutral code 126 counts as 0, because the amplifier's bias is
/// trimmed to it (what is left of it is the drive offset). Row 0 is the generator's state after ONE step from the seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weights {
    mode: WeightMode,
    seeding: Seeding,
    taxels: u32,
}

impl Weights {
    /// Weights of `taxels` taxels.
    #[must_use]
    pub fn new(mode: WeightMode, seeding: Seeding, taxels: u32) -> Self {
        Self { mode, seeding, taxels }
    }

    /// Number of taxels: the length of a row, and the period of the raster.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxels as usize
    }

    /// What the cells put out.
    #[must_use]
    pub fn mode(&self) -> WeightMode {
        self.mode
    }

    /// How the generators are seeded.
    #[must_use]
    pub fn seeding(&self) -> Seeding {
        self.seeding
    }

    /// Seed of taxel `taxel`.
    #[inline]
    pub(crate) fn seed(&self, taxel: usize) -> u32 {
        #[expect(clippy::cast_possible_truncation, reason = "`taxels` is a u32")]
        self.seeding.seed(taxel as u32)
    }

    /// Level of `taxel` at `row`, in O(log row).
    #[must_use]
    pub fn level(&self, taxel: u32, row: u64) -> f64 {
        match self.mode {
            WeightMode::Raster => f64::from(row.checked_rem(u64::from(self.taxels)) == Some(u64::from(taxel))),
            _ => self.level_from_seed(self.seeding.seed(taxel), row),
        }
    }

    /// Writes the levels of `taxel` at as many consecutive rows as `out` holds, starting with `first_row`.
    pub(crate) fn fill_levels(&self, taxel: u32, first_row: u64, out: &mut [f64]) {
        if self.mode == WeightMode::Raster {
            for (out, row) in out.iter_mut().zip(first_row..) {
                *out = self.level(taxel, row);
            }
            return;
        }
        let mut state = Jump::new(first_row).apply(self.seeding.seed(taxel));
        for out in out {
            state = Jump::ONE.apply(state);
            *out = self.mode.level(state);
        }
    }

    /// Level at `row` of a cell whose generator was loaded with `seed`; in raster mode no cell uses its seed, and the
    /// level is 0.
    #[must_use]
    pub fn level_from_seed(&self, seed: u32, row: u64) -> f64 {
        self.mode.level(Jump::new(row.wrapping_add(1)).apply(seed))
    }

    /// Writes row `row`, in O(log row + taxels).
    ///
    /// # Panics
    /// When `out` does not have one entry a taxel.
    pub fn fill_row(&self, row: u64, out: &mut [f64]) {
        self.fill_rows(row, out);
    }

    /// Writes as many consecutive rows as `out` holds, row-major, starting with `first_row`.
    ///
    /// # Panics
    /// When `out` is not a whole number of rows.
    pub fn fill_rows(&self, first_row: u64, out: &mut [f64]) {
        assert!(
            out.len().is_multiple_of(self.taxels().max(1)),
            "{} values are not a whole number of rows of {}",
            out.len(),
            self.taxels
        );
        let mut clock = self.clock(first_row);
        for row in out.chunks_exact_mut(self.taxels().max(1)) {
            clock.next_row(row);
        }
    }

    /// Σₖ wₖ·valuesₖ at as many consecutive rows as `out` holds, starting with `first_row`; the matrix is never stored. The sums
    /// are the same bits on every machine and however the rows are cut into calls.
    ///
    /// # Panics
    /// When `values` does not have one entry a taxel.
    pub fn weighted_sums(&self, first_row: u64, values: &[f64], out: &mut [f64]) {
        assert_eq!(values.len(), self.taxels(), "one value a taxel");
        if values.is_empty() {
            out.fill(0.0);
            return;
        }
        let (mut rows, mut sums) = (Rows::new(*self), Sums::default());
        for (out, first_row) in out.chunks_mut(ROWS).zip((first_row..).step_by(ROWS)) {
            rows.go_to(first_row, out.len());
            let lines = Lines {
                from: values,
                to: None,
                share: &[0.0; ROWS],
            };
            rows.sum(lines, &mut sums);
            for (i, out) in out.iter_mut().enumerate() {
                *out = rows.weighted(&lines, &sums, i);
            }
        }
    }

    /// Signs of the binary weights at consecutive rows, packed: bit k of a row is set where taxel k's weight is +1. A row takes
    /// ⌈taxels/64⌉ words, the rest of the last one 0. For the other modes these are the top bits of the generators.
    ///
    /// # Panics
    /// When `out` is not a whole number of rows.
    pub fn sign_bits(&self, first_row: u64, out: &mut [u64]) {
        let words = self.taxels().div_ceil(64).max(1);
        assert!(
            out.len().is_multiple_of(words),
            "{} words are not a whole number of rows of {words}",
            out.len()
        );
        let jump = Jump::new(first_row);
        for word in 0..words {
            let mut states = [0; 64];
            for (l, state) in states.iter_mut().enumerate() {
                *state = jump.apply(self.seed(64 * word + l));
            }
            top_bits(&mut states, out, word, words);
        }
        if let used @ 1.. = self.taxels() % 64 {
            for last in out.iter_mut().skip(words - 1).step_by(words) {
                *last &= (1 << used) - 1;
            }
        }
    }

    /// Clock whose next row is `row`.
    #[must_use]
    pub fn clock(&self, row: u64) -> WeightClock {
        let jump = Jump::new(row);
        let states = match self.mode {
            WeightMode::Raster => Vec::new(),
            _ => (0..self.taxels).map(|k| jump.apply(self.seeding.seed(k))).collect(),
        };
        WeightClock {
            weights: *self,
            row,
            states,
        }
    }
}

/// Rows one after another: the state of every cell.
#[derive(Debug, Clone)]
pub struct WeightClock {
    weights: Weights,
    row: u64,
    states: Vec<u32>,
}

impl WeightClock {
    /// Weights that the clock steps through.
    #[must_use]
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Index of the row that comes next.
    #[must_use]
    pub fn row(&self) -> u64 {
        self.row
    }

    /// Writes the next row and moves on. `out` has one entry a taxel.
    pub fn next_row(&mut self, out: &mut [f64]) {
        match self.weights.mode {
            WeightMode::Raster => {
                out.fill(0.0);
                let taxels = u64::from(self.weights.taxels).max(1);
                if let Some(level) = usize::try_from(self.row % taxels).ok().and_then(|k| out.get_mut(k)) {
                    *level = 1.0;
                }
            }
            WeightMode::Analog => self.step_into(out, analog),
            WeightMode::Binary => self.step_into(out, binary),
        }
        self.row += 1;
    }

    #[inline(always)]
    fn step_into(&mut self, out: &mut [f64], level: impl Fn(u32) -> f64) {
        for (state, out) in self.states.iter_mut().zip(out) {
            *state = Jump::ONE.apply(*state);
            *out = level(*state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEVICE: [WeightMode; 3] = [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary];

    /// Against the rows themselves; two orders of n additions of values below 10 differ by less than n roundings of 10·n.
    #[test]
    fn sums_are_the_rows_times_the_values() {
        for taxels in [1_u32, 5, 64, 100, 131] {
            let n = taxels as usize;
            let values: Vec<f64> = (0..n).map(|k| (0.7 * k as f64).sin() * 10.0).collect();
            for mode in DEVICE {
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

    #[test]
    fn sign_bits_are_the_signs() {
        for taxels in [1_u32, 63, 64, 100, 200] {
            let n = taxels as usize;
            let words = n.div_ceil(64);
            let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, taxels);
            let (mut bits, mut rows) = (vec![u64::MAX; 50 * words], vec![0.0; 50 * n]);
            weights.sign_bits(1 << 40, &mut bits);
            weights.fill_rows(1 << 40, &mut rows);
            for (bits, row) in bits.chunks(words).zip(rows.chunks(n)) {
                for k in 0..64 * words {
                    let expected = row.get(k).is_some_and(|w| *w > 0.0);
                    assert_eq!(bits[k / 64] >> (k % 64) & 1 == 1, expected, "taxel {k} of {taxels}");
                }
            }
        }
    }

    #[test]
    fn a_skin_without_taxels_has_no_weights() {
        for mode in DEVICE {
            let weights = Weights::new(mode, Seeding::Address, 0);
            let (mut sums, mut bits) = ([f64::NAN; 3], [u64::MAX; 3]);
            weights.weighted_sums(7, &[], &mut sums);
            weights.sign_bits(7, &mut bits);
            assert!(sums.iter().all(|sum| sum.abs() < f64::MIN_POSITIVE), "{mode:?}");
            weights.fill_rows(7, &mut []);
            assert!(weights.level(0, 7).abs() <= 1.0);
        }
        assert!(Weights::new(WeightMode::Raster, Seeding::Address, 0).level(0, 0).abs() < f64::MIN_POSITIVE);
    }

    proptest! {
        #[test]
        fn levels_of_a_taxel_are_its_column(first in 0_u64..1_000_000_000_000, taxels in 1_u32..130) {
            for mode in DEVICE {
                let weights = Weights::new(mode, Seeding::Mixed, taxels);
                let (taxel, mut column) = (taxels / 2, [f64::NAN; 9]);
                weights.fill_levels(taxel, first, &mut column);
                let expected: Vec<f64> = (first..first + 9).map(|row| weights.level(taxel, row)).collect();
                prop_assert_eq!(column.to_vec(), expected);
            }
        }

        #[test]
        fn any_row_equals_its_levels(first in 0_u64..1_000_000_000_000, taxels in 1_u32..130) {
            for mode in DEVICE {
                for seeding in [Seeding::Address, Seeding::Mixed] {
                    let weights = Weights::new(mode, seeding, taxels);
                    let mut rows = vec![f64::NAN; 3 * weights.taxels()];
                    weights.fill_rows(first, &mut rows);
                    let expected: Vec<f64> =
                        (0..3).flat_map(|r| (0..taxels).map(move |k| weights.level(k, first + r))).collect();
                    prop_assert_eq!(rows, expected);
                }
            }
        }
    }
}
