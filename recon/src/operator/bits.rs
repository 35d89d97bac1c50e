//! Rows of ±1 that are stored as bits.

use crate::kernels::dot;
use crate::matrix::Matrix;
use crate::operator::{LinearOperator, SelectColumns};
use multiversion::multiversion;
use rayon::prelude::*;
use std::ops::Range;

/// Bits of a word.
const WORD: usize = u64::BITS as usize;
/// Words of a block of columns whose sums stay in the first-level cache.
const BLOCK: usize = 16;

/// M × N matrix of ±1 with a bit for each weight, 64 times less than as numbers: bit k of a row (bit k mod 64 of its
/// word ⌊k/64⌋) is set for +1. Every sum has a fixed order, so the bits of the results are the same for any number of
/// threads.
///
/// ```
/// use spts_recon::operator::{LinearOperator as _, SignRows};
///
/// // the rows (+, −, +) and (−, −, +)
/// let rows = SignRows::new(&[0b101, 0b100], 3);
/// let (mut y, mut x) = ([0.0; 2], [0.0; 3]);
/// rows.apply(&[1.0, 2.0, 4.0], &mut y);
/// rows.apply_adjoint(&[1.0, 10.0], &mut x);
/// assert_eq!((y, x), ([3.0, 1.0], [-9.0, -11.0, 11.0]));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct SignRows<'a> {
    bits: &'a [u64],
    ncols: usize,
}

impl<'a> SignRows<'a> {
    /// The rows in `bits`, ⌈`ncols`/64⌉ words each.
    ///
    /// # Panics
    /// If `bits` are not whole rows.
    pub fn new(bits: &'a [u64], ncols: usize) -> Self {
        assert!(bits.len().is_multiple_of(ncols.div_ceil(WORD).max(1)), "{} words of {ncols} columns", bits.len());
        Self { bits, ncols }
    }

    /// The rows with these numbers.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn part(self, rows: Range<usize>) -> Self {
        let words = self.words();
        Self { bits: &self.bits[rows.start * words..rows.end * words], ..self }
    }

    /// The words of row number `row`.
    pub(crate) fn row(&self, row: usize) -> &'a [u64] {
        &self.bits[row * self.words()..][..self.words()]
    }

    fn words(&self) -> usize {
        self.ncols.div_ceil(WORD).max(1)
    }
}

impl LinearOperator for SignRows<'_> {
    fn nrows(&self) -> usize {
        self.bits.len() / self.words()
    }

    fn ncols(&self) -> usize {
        self.ncols
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        super::check_shape(self, x, y);
        // images of contacts are zero nearly everywhere
        let touched: Vec<usize> = (0..x.len()).filter(|k| x[*k] != 0.0).collect();
        let total: f64 = touched.iter().map(|k| x[*k]).sum();
        y.par_iter_mut().zip(self.bits.par_chunks_exact(self.words())).for_each(|(y, row)| {
            let plus = touched.iter().filter(|k| row[**k / WORD] >> (**k % WORD) & 1 == 1);
            *y = 2.0 * plus.map(|k| x[*k]).sum::<f64>() - total;
        });
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        super::check_shape(self, x, y);
        let words = self.words();
        x.par_chunks_mut(BLOCK * WORD).enumerate().for_each(|(block, x)| {
            let first = block * BLOCK;
            let mut sums = [[0.0; WORD]; BLOCK];
            for (row, y) in self.bits.chunks_exact(words).zip(y) {
                add_signs(*y, &row[first..(first + BLOCK).min(words)], &mut sums);
            }
            x.copy_from_slice(&sums.as_flattened()[..x.len()]);
        });
    }
}

/// Adds `y` to the sums whose bit is set, and subtracts it from the others.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add_signs(y: f64, words: &[u64], sums: &mut [[f64; WORD]; BLOCK]) {
    let bits = y.to_bits();
    for (word, sums) in words.iter().zip(sums) {
        let minus = !word;
        for (k, sum) in (0_u32..).zip(sums) {
            *sum += f64::from_bits(bits ^ ((minus >> k) << 63));
        }
    }
}

impl SelectColumns for SignRows<'_> {
    type Selected = Matrix;

    fn select_columns(&self, columns: &[usize]) -> Matrix {
        let mut selected = Matrix::zeros(self.nrows(), columns.len());
        for (r, row) in self.bits.chunks_exact(self.words()).enumerate() {
            for (out, k) in selected.row_mut(r).iter_mut().zip(columns) {
                *out = if row[k / WORD] >> (k % WORD) & 1 == 1 { 1.0 } else { -1.0 };
            }
        }
        selected
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        super::check_shape(self, variance, r);
        variance.fill(dot(r, r));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::check_operator;

    #[test]
    fn bits_are_a_matrix_of_signs() {
        for ncols in [1_usize, 63, 64, 65, 1023, 1025, 2100] {
            let words = ncols.div_ceil(64) as u64;
            let bits: Vec<u64> =
                (0..7 * words).map(|k: u64| (k + 3).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31)).collect();
            let rows = SignRows::new(&bits, ncols);
            check_operator(&rows);
            let all: Vec<usize> = (0..ncols).collect();
            let dense = rows.select_columns(&all);
            let x: Vec<f64> = (0..ncols).map(|k| (k as f64).sin()).collect();
            let (mut y, mut expected) = (vec![0.0; 7], vec![0.0; 7]);
            rows.apply(&x, &mut y);
            dense.apply(&x, &mut expected);
            assert!(y.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-9), "{ncols}: {y:?} {expected:?}");
            let (mut back, mut wanted) = (vec![0.0; ncols], vec![0.0; ncols]);
            rows.apply_adjoint(&y, &mut back);
            dense.apply_adjoint(&y, &mut wanted);
            assert!(back.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{ncols}");
        }
    }
}
