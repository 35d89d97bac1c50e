//! A set of seeds and the rows of its sensing matrix.

use super::error::SeedError;
use rand::seq::SliceRandom as _;
use serde::Serialize;
use spts_circuit::{Jump, MAX_SEEDS_BYTES, Seeding, WeightMode, parse_seeds};
use spts_models::Streams;
use spts_recon::Matrix;
use std::path::Path;

/// Sides of the skins that can be looked at.
pub(super) const SIDES: std::ops::RangeInclusive<usize> = 4..=32;

/// Seeds of the cells of a square skin, taxel by taxel.
///
/// ```
/// use spts_studies::seeds::SeedSet;
///
/// let set = SeedSet::parse("mine", "--seeds", "1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16")?;
/// assert_eq!(set.side(), 4);
/// let error = SeedSet::parse("mine", "--seeds", "8, 9, 10").unwrap_err();
/// assert!(error.to_string().contains("number of seeds = 3"));
/// # Ok::<(), spts_studies::seeds::SeedError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SeedSet {
    /// Name in tables.
    pub name: String,
    /// Seed of every taxel, row-major; a square number.
    pub seeds: Vec<u32>,
}

impl SeedSet {
    /// The seeds of the circuit's rule `seeding` for a skin of `side` × `side` taxels.
    #[must_use]
    pub fn of(seeding: Seeding, side: usize) -> Self {
        let name = match seeding {
            Seeding::Address => "address",
            Seeding::Mixed => "mixed",
        };
        Self {
            name: name.to_owned(),
            seeds: (0..).map(|taxel| seeding.seed(taxel)).take(side * side).collect(),
        }
    }

    /// Different random bytes: seeds for cells that accept only one byte, like those with the published firmware.
    /// `None` for more than 256 taxels.
    #[must_use]
    pub fn bytes(side: usize, streams: Streams) -> Option<Self> {
        let mut bytes: Vec<u32> = (0..=u32::from(u8::MAX)).collect();
        bytes.shuffle(&mut streams.rng("bytes", 0));
        (side * side <= bytes.len()).then(|| Self {
            name: "bytes".to_owned(),
            seeds: bytes[..side * side].to_vec(),
        })
    }

    /// Reads seeds from `text` like [`parse_seeds`]; `source` is named in errors.
    ///
    /// # Errors
    /// [`SeedError`] for a word that is not a seed, or a number of seeds that is not that of a square skin.
    pub fn parse(name: &str, source: &str, text: &str) -> Result<Self, SeedError> {
        let seeds = parse_seeds(text).map_err(|error| SeedError::NoSeed {
            source_name: source.to_owned(),
            line: error.line,
            word: error.word,
        })?;
        let set = Self {
            name: name.to_owned(),
            seeds,
        };
        if SIDES.contains(&set.side()) && set.side() * set.side() == set.seeds.len() {
            return Ok(set);
        }
        Err(SeedError::NotSquare {
            source_name: source.to_owned(),
            seeds: set.seeds.len(),
            least: SIDES.start().pow(2),
            most: SIDES.end().pow(2),
        })
    }

    /// Seeds in the file `path`, see [`Self::parse`].
    ///
    /// # Errors
    /// [`SeedError::Read`] if the file cannot be read, and as [`Self::parse`].
    pub fn read(path: &Path) -> Result<Self, SeedError> {
        let text = spts_input::read_text(path, MAX_SEEDS_BYTES).map_err(|error| SeedError::Read {
            path: path.to_owned(),
            source: error.into(),
        })?;
        let name = path
            .file_name()
            .map_or_else(|| "file".into(), |name| name.to_string_lossy());
        Self::parse(&name, &path.display().to_string(), &text)
    }

    /// Taxels along one side of the skin.
    #[must_use]
    pub fn side(&self) -> usize {
        self.seeds.len().isqrt()
    }

    /// `nrows` rows of the sensing matrix from row `first_row` on, counted from loading the seeds: levels in [−1, 1].
    #[must_use]
    pub fn rows(&self, mode: WeightMode, first_row: u64, nrows: usize) -> Matrix {
        let jump = Jump::new(first_row);
        let mut states: Vec<u32> = self.seeds.iter().map(|&seed| jump.apply(seed)).collect();
        let mut rows = Matrix::zeros(nrows, states.len());
        for r in 0..nrows {
            for (level, state) in rows.row_mut(r).iter_mut().zip(&mut states) {
                // a cell's level one step after any state is a function of the state alone
                *level = mode.level_from_seed(*state, 0);
                *state = Jump::ONE.apply(*state);
            }
        }
        rows
    }

    /// Smallest number of rows after which a taxel starts to repeat another one's levels. All generators run through
    /// the same cycle of 2³² states; a seed is a position on it.
    #[must_use]
    pub fn least_phase(&self) -> u64 {
        let mut phases: Vec<u64> = self.seeds.iter().map(|&seed| u64::from(phase(seed))).collect();
        phases.sort_unstable();
        let around = phases.first().map(|first| first + PERIOD_ROWS);
        let next = phases.iter().copied().skip(1).chain(around);
        phases.iter().zip(next).map(|(a, b)| b - a).min().unwrap_or(PERIOD_ROWS)
    }
}

/// Rows after which every generator starts again.
pub(super) const PERIOD_ROWS: u64 = 1 << 32;

/// Number of steps from state 0 to `state`: 2^i steps leave the i lowest bits as they are and flip the next one,
/// because the lowest bits are a generator of full period themselves.
fn phase(state: u32) -> u32 {
    let (mut steps, mut at) = (0, 0);
    for bit in 0..u32::BITS {
        if (at ^ state) >> bit & 1 == 1 {
            steps |= 1 << bit;
            at = Jump::new(1 << bit).apply(at);
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::Weights;
    use spts_recon::coherence;

    #[test]
    fn rows_are_the_circuits() {
        for mode in [WeightMode::Binary, WeightMode::Analog] {
            for seeding in [Seeding::Address, Seeding::Mixed] {
                let set = SeedSet::of(seeding, 10);
                let found = set.rows(mode, 12_345, 7);
                let mut expected = vec![0.0; 700];
                Weights::new(mode, seeding, 100).fill_rows(12_345, &mut expected);
                assert_eq!(found.view().values(), expected);
            }
        }
    }

    /// Known of the published cells: the first 100 rows of {0, 1} weights have rank 97, 150 rows have rank 100.
    #[test]
    fn the_published_seeds_have_the_known_rank() {
        let rank = |seeding, nrows| {
            let mut rows = SeedSet::of(seeding, 10).rows(WeightMode::Binary, 0, nrows);
            for r in 0..nrows {
                rows.row_mut(r).iter_mut().for_each(|w| *w = 0.5 * (*w + 1.0));
            }
            coherence::spectrum(rows.view()).unwrap().rank
        };
        assert_eq!(rank(Seeding::Address, 100), 97);
        assert_eq!(rank(Seeding::Address, 150), 100);
        assert_eq!(rank(Seeding::Mixed, 100), 100);
    }

    #[test]
    fn the_phase_is_the_number_of_steps() {
        for steps in [0_u32, 1, 2, 3, 1000, 0x8000_0000, 0xffff_ffff] {
            assert_eq!(phase(Jump::new(u64::from(steps)).apply(0)), steps);
        }
        let apart = |steps: &[u64]| SeedSet {
            name: String::new(),
            seeds: steps.iter().map(|&steps| Jump::new(steps).apply(77)).collect(),
        };
        assert_eq!(apart(&[0, 5000, 900_000, 901_234]).least_phase(), 1234);
        // around the end of the cycle
        assert_eq!(apart(&[10, 5000, PERIOD_ROWS - 20]).least_phase(), 30);
        assert_eq!(apart(&[3, 9, 3]).least_phase(), 0);
    }

    #[test]
    fn bytes_differ_and_end() {
        let set = SeedSet::bytes(16, Streams::new(1)).unwrap();
        let mut sorted = set.seeds.clone();
        sorted.sort_unstable();
        assert!(sorted == (0..256).collect::<Vec<u32>>() && sorted != set.seeds);
        assert_eq!(SeedSet::bytes(17, Streams::new(1)), None);
    }

    #[test]
    fn seeds_are_read_and_refused() {
        let list: Vec<String> = (0..16).map(|i| format!("{}", 8 + i)).collect();
        let set = SeedSet::parse("list", "`--seeds`", &list.join(",")).unwrap();
        assert_eq!((set.side(), set.seeds[15]), (4, 23));
        let text = "# sixteen\n0x10 0xffffffff\n1,2, 3 4\t5 6 7 8 # and more\r\n9 10 11 12 13 14";
        assert_eq!(SeedSet::parse("file", "f", text).unwrap().seeds[1], u32::MAX);
        for (text, word) in [
            ("1 2 3", "number of seeds = 3"),
            ("", "number of seeds = 0"),
            ("4294967296", "seed = `4294967296`"),
            ("8\n-1", "line 2: seed = `-1`"),
            ("1.5", "[0, 4294967295]"),
            ("0xg", "seed = `0xg`"),
        ] {
            let error = SeedSet::parse("list", "s.txt", text).unwrap_err().to_string();
            assert!(error.starts_with("s.txt") && error.contains(word), "{text}: {error}");
        }
    }
}
