//! Rows of the weight matrix of some measurements.

use crate::mode::WeightMode;
use crate::weights::{WeightClock, Weights};

/// Consecutive rows of the weight matrix Φ, one for each measurement. No row is stored; the matrix of a large skin can
/// be filled piece by piece with [`WeightRows::chunks`].
///
/// ```
/// use spts_circuit::{Seeding, WeightMode, WeightRows, Weights};
///
/// let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 100);
/// let rows = WeightRows::new(&weights, 24_300, 20);
/// let phi = rows.to_vec();
/// assert_eq!(phi.len(), 20 * 100);
/// // the same rows in two pieces
/// let pieces: Vec<f64> = rows.chunks(13).flat_map(|piece| piece.to_vec()).collect();
/// assert_eq!(phi, pieces);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct WeightRows<'a> {
    weights: &'a Weights,
    first_row: u64,
    len: usize,
}

impl<'a> WeightRows<'a> {
    /// The `len` rows of `weights` from row `first_row` on, counted from loading the seeds.
    #[must_use]
    pub fn new(weights: &'a Weights, first_row: u64, len: usize) -> Self {
        Self {
            weights,
            first_row,
            len,
        }
    }

    /// The weights to which the rows belong.
    #[must_use]
    pub fn weights(&self) -> &'a Weights {
        self.weights
    }

    /// Number of the first row, counted from loading the seeds.
    #[must_use]
    pub fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of taxels: the length of a row.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.weights.taxels()
    }

    /// The rows `start..start + len` of this range of rows, counted from its first.
    ///
    /// # Panics
    /// If there are fewer rows.
    #[must_use]
    pub fn slice(&self, start: usize, len: usize) -> Self {
        assert!(start + len <= self.len, "rows {start}..{} of {}", start + len, self.len);
        Self::new(self.weights, self.first_row + start as u64, len)
    }

    /// The rows in pieces of `len`; the last piece may be shorter.
    ///
    /// # Panics
    /// If `len` is 0.
    pub fn chunks(self, len: usize) -> impl Iterator<Item = Self> {
        let starts = (0..self.len).step_by(len);
        starts.map(move |start| self.slice(start, len.min(self.len - start)))
    }

    /// Writes the levels, each in [−1, 1], row-major.
    ///
    /// # Panics
    /// If `out` does not have one entry for each row and taxel.
    pub fn fill(&self, out: &mut [f64]) {
        let expected = self.len * self.taxels();
        assert_eq!(out.len(), expected, "one entry a row and taxel");
        self.weights.fill_rows(self.first_row, out);
    }

    /// The levels, each in [−1, 1], row-major.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        let mut rows = vec![0.0; self.len * self.taxels()];
        self.fill(&mut rows);
        rows
    }

    /// Packed signs of binary weights, ⌈taxels/64⌉ words a row: bit k of a row is set if taxel k has the weight +1.
    /// `None` if the weights are not binary.
    #[must_use]
    pub fn sign_bits(&self) -> Option<Vec<u64>> {
        (self.weights.mode() == WeightMode::Binary).then(|| {
            let mut bits = vec![0; self.len * self.taxels().div_ceil(64)];
            self.weights.sign_bits(self.first_row, &mut bits);
            bits
        })
    }

    /// Iterates over rows, from the first one on and beyond the last.
    #[must_use]
    pub fn clock(&self) -> WeightClock {
        self.weights.clock(self.first_row)
    }
}
