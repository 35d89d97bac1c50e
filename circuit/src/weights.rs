//! Drive levels of every taxel at every measurement.

use crate::codes::code_of;
use crate::kernels::top_bits;
use crate::lcg::Jump;
use crate::level_source::LevelSource;
use crate::mode::{WeightMode, analog, binary};
use crate::patterns::Patterns;
use crate::seeding::{Seeding, Seeds};
use crate::weights_error::WeightsError;
use std::sync::Arc;

/// Most taxels that seeds are listed for.
const MAX_SEEDS: usize = 1 << 24;

/// Drive levels of a skin of `taxels` taxels. Row `r` holds the level of every taxel at measurement `r`; rows are
/// counted from 0 in clock edges since loading the seeds.
///
/// A level is the drive divided by its full scale. DAC code k drives (k − 127.5)/127.5: codes 0 and 255 are −1 and +1,
/// and the analog levels lie between them. The neutral code 126 of the raster scan counts as 0, because the amplifier's
/// bias is trimmed to it (the effect `drive_offset` models the remainder). Row 0 is the generator's state after ONE
/// step from the seed.
///
/// The levels come from the cells' generators, seeded by a rule ([`Weights::new`]) or with given seeds
/// ([`Weights::with_seeds`]), or from a pattern ([`Weights::with_patterns`]). The examples read
/// them from text, JSON or TOML: seeds by a rule, given seeds, a pattern, and a raster scan.
///
/// ```
/// use spts_circuit::{Seeding, WeightMode, Weights};
///
/// let mixed: Weights =
///     serde_json::from_str(r#"{"mode": "binary", "taxels": 100, "generator": "lcg", "seeding": "mixed"}"#)?;
/// assert_eq!(mixed, Weights::new(WeightMode::Binary, Seeding::Mixed, 100));
///
/// let seeded: Weights = serde_json::from_str(r#"{"mode": "analog", "generator": "lcg", "seeds": [17, 4, 90]}"#)?;
/// assert_eq!((seeded.taxels(), seeded.seed(2)), (3, Some(90)));
///
/// let patterned: Weights =
///     serde_json::from_str(r#"{"mode": "binary", "patterns": {"period": 2, "codes": [0, 255, 255, 0]}}"#)?;
/// assert_eq!(patterned.level(1, 2), 1.0);
///
/// let raster: Weights = serde_json::from_str(r#"{"mode": "raster", "taxels": 100}"#)?;
/// assert_eq!(raster.level(7, 107), 1.0);
/// # Ok::<(), serde_json::Error>(())
/// ```
///
/// `generator` may be omitted. `taxels` may be given together with a list and is then checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Weights {
    mode: WeightMode,
    source: LevelSource,
    taxels: u32,
}

impl Weights {
    /// Weights of `taxels` taxels whose generators are seeded by a rule.
    #[must_use]
    pub fn new(mode: WeightMode, seeding: Seeding, taxels: u32) -> Self {
        Self {
            mode,
            source: LevelSource::Seeding(seeding),
            taxels,
        }
    }

    /// Weights with one generator seed for each taxel.
    ///
    /// # Errors
    /// [`WeightsError`] for no seed, more than 2²⁴ seeds, or the raster mode, which uses no seeds.
    pub fn with_seeds(mode: WeightMode, seeds: impl Into<Arc<[u32]>>) -> Result<Self, WeightsError> {
        let (field, seeds) = ("seeds", seeds.into());
        if mode == WeightMode::Raster {
            return Err(WeightsError::Mode { field, mode });
        }
        match u32::try_from(seeds.len()) {
            Ok(taxels) if (1..=MAX_SEEDS).contains(&seeds.len()) => Ok(Self {
                mode,
                source: LevelSource::Seeds(seeds),
                taxels,
            }),
            _ => Err(WeightsError::Length {
                field,
                len: seeds.len(),
                most: MAX_SEEDS,
            }),
        }
    }

    /// Weights that repeat `patterns`. In analog mode every code is a level; in binary mode 0 is −1 and 255 is +1.
    ///
    /// # Errors
    /// [`WeightsError`] for other codes in binary mode, or for the raster mode, which scans its taxels in order.
    pub fn with_patterns(mode: WeightMode, patterns: Patterns) -> Result<Self, WeightsError> {
        patterns.check(mode)?;
        let taxels = u32::try_from(patterns.taxels()).unwrap_or(u32::MAX);
        Ok(Self {
            mode,
            source: LevelSource::Patterns(Arc::new(patterns)),
            taxels,
        })
    }

    /// Number of taxels: the length of a row, and the period of the raster.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxels as usize
    }

    /// Kind of the levels.
    #[must_use]
    pub fn mode(&self) -> WeightMode {
        self.mode
    }

    /// Source of the levels.
    #[must_use]
    pub fn source(&self) -> &LevelSource {
        &self.source
    }

    /// The pattern that the levels repeat; `None` if they come from generators.
    #[must_use]
    pub fn patterns(&self) -> Option<&Patterns> {
        match &self.source {
            LevelSource::Patterns(patterns) => Some(patterns),
            _ => None,
        }
    }

    /// Seed of taxel `taxel`; `None` if the levels come from a pattern, or there is no such taxel.
    #[must_use]
    pub fn seed(&self, taxel: usize) -> Option<u32> {
        (taxel < self.taxels()).then_some(())?;
        Some(self.seeds()?.seed(taxel))
    }

    /// Seeds of the taxels; `None` when the levels come from a pattern.
    #[inline]
    pub(crate) fn seeds(&self) -> Option<Seeds<'_>> {
        self.source.seeds()
    }

    /// Level of `taxel` at `row`, in O(log row).
    ///
    /// # Panics
    /// If the levels come from a list or a pattern without such a taxel.
    #[must_use]
    pub fn level(&self, taxel: u32, row: u64) -> f64 {
        match (self.mode, &self.source) {
            (WeightMode::Raster, _) => f64::from(row.checked_rem(u64::from(self.taxels)) == Some(u64::from(taxel))),
            (mode, LevelSource::Patterns(patterns)) => mode.code_level(patterns.row(row)[taxel as usize]),
            (mode, LevelSource::Seeding(seeding)) => mode.level_from_seed(seeding.seed(taxel), row),
            (mode, LevelSource::Seeds(seeds)) => mode.level_from_seed(seeds[taxel as usize], row),
        }
    }

    /// Writes the levels of `taxel` at as many consecutive rows as `out` holds, starting with `first_row`.
    pub(crate) fn fill_levels(&self, taxel: u32, first_row: u64, out: &mut [f64]) {
        let (Some(seeds), WeightMode::Analog | WeightMode::Binary) = (self.seeds(), self.mode) else {
            for (out, row) in out.iter_mut().zip(first_row..) {
                *out = self.level(taxel, row);
            }
            return;
        };
        let mut state = Jump::new(first_row).apply(seeds.seed(taxel as usize));
        for out in out {
            state = Jump::ONE.apply(state);
            *out = self.mode.level(state);
        }
    }

    /// Fills `out` with consecutive rows from `first_row` on, row-major.
    ///
    /// # Panics
    /// If the length of `out` is not a whole number of rows.
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

    /// Packed signs of the binary weights at consecutive rows: bit k of a row is set if taxel k has the weight +1. A
    /// row has ⌈taxels/64⌉ words; unused bits are 0. For the other modes these are the top bits of the generators, or
    /// of the pattern's codes.
    ///
    /// # Panics
    /// If the length of `out` is not a whole number of rows.
    pub fn sign_bits(&self, first_row: u64, out: &mut [u64]) {
        let words = self.taxels().div_ceil(64).max(1);
        assert!(
            out.len().is_multiple_of(words),
            "{} words are not a whole number of rows of {words}",
            out.len()
        );
        if let Some(seeds) = self.seeds() {
            let jump = Jump::new(first_row);
            for word in 0..words {
                let mut states = [0; 64];
                for (l, state) in states.iter_mut().enumerate() {
                    *state = jump.apply(seeds.seed(64 * word + l));
                }
                top_bits(&mut states, out, word, words);
            }
        } else if let Some(patterns) = self.patterns() {
            for (row, out) in (first_row..).zip(out.chunks_exact_mut(words)) {
                for (word, codes) in out.iter_mut().zip(patterns.row(row).chunks(64)) {
                    let bits = codes.iter().rev();
                    *word = bits.fold(0, |word, code| (word << 1) | u64::from(code >> 7));
                }
            }
        }
        if let used @ 1.. = self.taxels() % 64 {
            for last in out.iter_mut().skip(words - 1).step_by(words) {
                *last &= (1 << used) - 1;
            }
        }
    }

    /// Fills `out` with the DAC codes of the levels at consecutive rows from `first_row` on, row-major.
    ///
    /// # Panics
    /// If the length of `out` is not a whole number of rows.
    pub fn fill_codes(&self, first_row: u64, out: &mut [u8]) {
        let taxels = self.taxels().max(1);
        assert!(
            out.len().is_multiple_of(taxels),
            "{} codes are not a whole number of rows of {}",
            out.len(),
            self.taxels
        );
        let (mut clock, mut row) = (self.clock(first_row), vec![0.0; self.taxels()]);
        for out in out.chunks_exact_mut(taxels) {
            clock.next_row(&mut row);
            for (out, level) in out.iter_mut().zip(&row) {
                *out = code_of(*level);
            }
        }
    }

    /// A clock whose next row is `row`.
    #[must_use]
    pub fn clock(&self, row: u64) -> WeightClock {
        let jump = Jump::new(row);
        let states = match (self.mode, self.seeds()) {
            (WeightMode::Raster, _) | (_, None) => Vec::new(),
            (_, Some(seeds)) => (0..self.taxels()).map(|k| jump.apply(seeds.seed(k))).collect(),
        };
        WeightClock {
            weights: self.clone(),
            row,
            states,
        }
    }
}

/// Iterates over rows; holds the generator state of every cell.
#[derive(Debug, Clone)]
pub struct WeightClock {
    weights: Weights,
    row: u64,
    states: Vec<u32>,
}

impl WeightClock {
    /// Writes the next row and advances. `out` has one entry a taxel.
    pub fn next_row(&mut self, out: &mut [f64]) {
        let mode = self.weights.mode;
        if let Some(patterns) = self.weights.patterns() {
            for (out, code) in out.iter_mut().zip(patterns.row(self.row)) {
                *out = mode.code_level(*code);
            }
            self.row += 1;
            return;
        }
        match mode {
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
                        (0..3).flat_map(|r| (0..taxels).map(move |k| (k, first + r))).map(|(k, r)| weights.level(k, r)).collect();
                    prop_assert_eq!(rows, expected);
                }
            }
        }
    }
}
