//! Seeds whose generators put out a given first window.

use crate::lcg::Jump;
use crate::patterns::Patterns;
use std::collections::BTreeMap;

/// Most rows of a window. All 2²⁴ windows of so many are in the sequence, the last one 271,551,075 steps behind state
/// 0.
const MOST_ROWS: usize = 24;
/// Number of states of a generator, and so of seeds.
const STATES: u64 = 1 << 32;

/// Why there are no seeds for a window.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FirstWindowError {
    /// Too many rows.
    #[error("a window of {rows} rows is outside [1, {MOST_ROWS}]")]
    Rows {
        /// Rows of the window.
        rows: usize,
    },
    /// A level that no generator puts out in binary mode.
    #[error("row {row}, taxel {taxel}: code {code} is not 0 or 255, what a generator puts out in binary mode")]
    Code {
        /// Row, 0-based.
        row: usize,
        /// Taxel, 0-based.
        taxel: usize,
        /// Code.
        code: u8,
    },
}

/// Seeds, one a taxel, with which the cells' generators put out `window` in binary mode at rows 0 to M − 1 after the
/// seeds are loaded. Later rows are pseudorandom. The search is exact: it enumerates the states of the generator and
/// stops when every taxel has a seed.
///
/// ```
/// use spts_circuit::{WeightMode, Weights, parse_patterns, seeds_of_first_window};
///
/// let wanted = parse_patterns("++-\n-+-\n---\n+-+")?;
/// let weights = Weights::with_seeds(WeightMode::Binary, seeds_of_first_window(&wanted)?)?;
/// assert_eq!([0, 1, 2, 3].map(|row| weights.level(0, row)), [1.0, -1.0, -1.0, 1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`FirstWindowError`] for more than 24 rows, or levels other than ±1.
pub fn seeds_of_first_window(window: &Patterns) -> Result<Vec<u32>, FirstWindowError> {
    let rows = window.period();
    if rows > MOST_ROWS {
        return Err(FirstWindowError::Rows { rows });
    }
    let words = words(window)?;
    let mut seeds: BTreeMap<u32, u32> = words.iter().map(|word| (*word, 0)).collect();
    let mut wanted = vec![0_u64; (1_usize << rows).div_ceil(64)];
    for word in seeds.keys() {
        wanted[*word as usize / 64] |= 1 << (word % 64);
    }
    let mut left = seeds.len();
    let mask = (1_u32 << rows) - 1;
    // the sequence is a cycle: so many steps on is M steps back
    let back = Jump::new(STATES - rows as u64);
    let (mut state, mut word) = (0, 0);
    for step in 1.. {
        if left == 0 {
            break;
        }
        state = Jump::ONE.apply(state);
        word = (word << 1 | state >> 31) & mask;
        let bits = &mut wanted[word as usize / 64];
        if *bits >> (word % 64) & 1 == 1 && step >= rows {
            *bits &= !(1 << (word % 64));
            seeds.insert(word, back.apply(state));
            left -= 1;
        }
    }
    Ok(words.iter().map(|word| seeds[word]).collect())
}

/// Levels of every taxel, the one of row 0 in the highest bit.
fn words(window: &Patterns) -> Result<Vec<u32>, FirstWindowError> {
    let mut words = vec![0; window.taxels()];
    for row in 0..window.period() {
        for (taxel, (word, &code)) in words.iter_mut().zip(window.row(row as u64)).enumerate() {
            if !matches!(code, 0 | 255) {
                return Err(FirstWindowError::Code { row, taxel, code });
            }
            *word = *word << 1 | u32::from(code > 0);
        }
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mode::WeightMode;
    use crate::seeding::Seeding;
    use crate::weights::Weights;

    fn codes(weights: &Weights, rows: usize) -> Vec<u8> {
        let mut codes = vec![0; rows * weights.taxels()];
        weights.fill_codes(0, &mut codes);
        codes
    }

    /// Windows of another kind than a generator's: of a square wave a taxel.
    #[test]
    fn the_seeds_give_the_window() {
        for rows in [1, 2, 20, 24] {
            let taxels = 50;
            let wanted: Vec<u8> = (0..rows * taxels)
                .map(|k| {
                    if (k / taxels + k % taxels) / (1 + k % 7) % 2 == 0 {
                        0
                    } else {
                        255
                    }
                })
                .collect();
            let seeds = seeds_of_first_window(&Patterns::new(rows, wanted.clone()).unwrap()).unwrap();
            let weights = Weights::with_seeds(WeightMode::Binary, seeds).unwrap();
            assert_eq!(codes(&weights, rows), wanted, "{rows} rows");
        }
    }

    #[test]
    fn windows_that_cannot_be_are_refused() {
        let refused = |rows, codes: Vec<u8>| seeds_of_first_window(&Patterns::new(rows, codes).unwrap()).unwrap_err();
        assert_eq!(refused(25, vec![0; 25]), FirstWindowError::Rows { rows: 25 });
        assert!(matches!(
            refused(2, vec![0, 0, 0, 1]),
            FirstWindowError::Code { row: 1, taxel: 1, .. }
        ));
    }

    /// What a generator does put out is found again, whatever the seed was.
    #[test]
    fn a_window_of_a_generator_is_found_again() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 30);
        let window = codes(&weights, 22);
        let seeds = seeds_of_first_window(&Patterns::new(22, window.clone()).unwrap()).unwrap();
        let again = Weights::with_seeds(WeightMode::Binary, seeds).unwrap();
        assert_eq!(codes(&again, 22), window);
    }
    /// The search ends for any window.
    #[test]
    fn every_window_is_in_the_sequence() {
        let (mut seen, mut left) = (vec![0_u64; 1 << (MOST_ROWS - 6)], 1_u32 << MOST_ROWS);
        let (mut state, mut word, mut step) = (0, 0_u32, 0_usize);
        while left > 0 {
            state = Jump::ONE.apply(state);
            word = (word << 1 | state >> 31) & ((1 << MOST_ROWS) - 1);
            step += 1;
            let bits = &mut seen[word as usize / 64];
            if step >= MOST_ROWS && *bits >> (word % 64) & 1 == 0 {
                *bits |= 1 << (word % 64);
                left -= 1;
            }
        }
        assert_eq!(step, 271_551_075);
    }
}
