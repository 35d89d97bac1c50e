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
///
/// On several wires ([`SignRows::on_wires`]) a row has the weights ±1 of its own wire's taxels and 0 elsewhere.
#[derive(Debug, Clone, Copy)]
pub struct SignRows<'a> {
    bits: &'a [u64],
    ncols: usize,
    /// Wire of every row; empty for one wire.
    wires: &'a [u16],
    /// Columns of every wire, as bits.
    masks: &'a [u64],
}

impl<'a> SignRows<'a> {
    /// The rows in `bits`, ⌈`ncols`/64⌉ words each.
    ///
    /// # Panics
    /// If `bits` are not whole rows.
    pub fn new(bits: &'a [u64], ncols: usize) -> Self {
        assert!(bits.len().is_multiple_of(ncols.div_ceil(WORD).max(1)), "{} words of {ncols} columns", bits.len());
        Self { bits, ncols, wires: &[], masks: &[] }
    }

    /// The same rows on several wires: `wires` has the wire of every row, and `masks` the bits of the columns of every
    /// wire, ⌈`ncols`/64⌉ words each.
    ///
    /// # Panics
    /// If there is not one wire a row, or a wire has no mask.
    pub fn on_wires(self, wires: &'a [u16], masks: &'a [u64]) -> Self {
        let most = wires.iter().max().map_or(0, |wire| usize::from(*wire) + 1);
        let fits = wires.len() == self.nrows() && most * self.words() <= masks.len();
        assert!(fits, "{} rows of {} wires", self.nrows(), masks.len() / self.words());
        Self { wires, masks, ..self }
    }

    /// Wire of every row; empty for one wire.
    pub fn wires(&self) -> &'a [u16] {
        self.wires
    }

    /// Writes the weights, row-major.
    ///
    /// # Panics
    /// If `out` does not have one entry for each row and column.
    pub fn fill(&self, out: &mut [f64]) {
        assert_eq!(out.len(), self.nrows() * self.ncols, "one entry a row and column");
        for (r, row) in out.chunks_exact_mut(self.ncols.max(1)).enumerate() {
            row.iter_mut().enumerate().for_each(|(k, out)| *out = self.weight(r, k));
        }
    }

    /// The columns whose weights in a row are not 0, as bits; `None` for all.
    fn mask(&self, row: usize) -> Option<&'a [u64]> {
        let wire = usize::from(*self.wires.get(row)?);
        Some(&self.masks[wire * self.words()..][..self.words()])
    }

    /// Weight of a column in a row.
    #[inline]
    pub(crate) fn weight(&self, row: usize, column: usize) -> f64 {
        let bit = |words: &[u64]| words[column / WORD] >> (column % WORD) & 1 == 1;
        match (bit(self.row(row)), self.mask(row).is_none_or(bit)) {
            (true, true) => 1.0,
            (false, true) => -1.0,
            (_, false) => 0.0,
        }
    }

    /// The rows with these numbers.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn part(self, rows: Range<usize>) -> Self {
        let words = self.words();
        let wires = self.wires.get(rows.clone()).unwrap_or_default();
        Self { bits: &self.bits[rows.start * words..rows.end * words], wires, ..self }
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
        if !self.wires.is_empty() {
            let sum = |row| touched.iter().map(|k| self.weight(row, *k) * x[*k]).sum();
            y.par_iter_mut().enumerate().for_each(|(row, y)| *y = sum(row));
            return;
        }
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
            let end = (first + BLOCK).min(words);
            for (number, (row, y)) in self.bits.chunks_exact(words).zip(y).enumerate() {
                match self.mask(number) {
                    None => add_signs(*y, &row[first..end], &mut sums),
                    Some(mask) => add_masked(*y, &row[first..end], &mask[first..end], &mut sums),
                }
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

/// As [`add_signs`], for the columns whose bit in `mask` is set. Of most wires a block has none.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add_masked(y: f64, words: &[u64], mask: &[u64], sums: &mut [[f64; WORD]; BLOCK]) {
    let bits = y.to_bits();
    for ((word, mask), sums) in words.iter().zip(mask).zip(sums) {
        if *mask == 0 {
            continue;
        }
        let minus = !word;
        for (k, sum) in (0_u32..).zip(sums) {
            // all bits of y where the mask is set, none elsewhere
            let kept = (mask >> k & 1).wrapping_neg();
            *sum += f64::from_bits((bits ^ ((minus >> k) << 63)) & kept);
        }
    }
}

impl SelectColumns for SignRows<'_> {
    type Selected = Matrix;

    fn select_columns(&self, columns: &[usize]) -> Matrix {
        let mut selected = Matrix::zeros(self.nrows(), columns.len());
        for r in 0..self.nrows() {
            selected.row_mut(r).iter_mut().zip(columns).for_each(|(out, k)| *out = self.weight(r, *k));
        }
        selected
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        super::check_shape(self, variance, r);
        if self.wires.is_empty() {
            variance.fill(dot(r, r));
            return;
        }
        let count = self.masks.len() / self.words();
        let mut squares = vec![0.0; count];
        self.wires.iter().zip(r).for_each(|(wire, r)| squares[usize::from(*wire)] += r * r);
        for (k, variance) in variance.iter_mut().enumerate() {
            let on = |wire: &usize| self.masks[wire * self.words() + k / WORD] >> (k % WORD) & 1 == 1;
            *variance = (0..count).filter(on).map(|wire| squares[wire]).sum();
        }
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
            let mut variance = vec![f64::NAN; ncols];
            rows.chance_variance(&y, &mut variance);
            dense.view().chance_variance(&y, &mut wanted);
            assert!(variance.iter().zip(&wanted).all(|(a, b)| (a - b).abs() <= 1e-9 * b), "{ncols}");
        }
    }

    /// Columns k are on wire k mod 3.
    #[test]
    fn rows_of_wires_have_their_own_columns() {
        for ncols in [5_usize, 64, 1100] {
            let words = ncols.div_ceil(64);
            let mut masks = vec![0_u64; 3 * words];
            (0..ncols).for_each(|k| masks[k % 3 * words + k / 64] |= 1 << (k % 64));
            let bits: Vec<u64> =
                (0..8 * words as u64).map(|k| (k + 3).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31)).collect();
            let wires = [0, 1, 2, 0, 1, 2, 0, 2];
            let rows = SignRows::new(&bits, ncols).on_wires(&wires, &masks);
            check_operator(&rows);
            let all: Vec<usize> = (0..ncols).collect();
            let dense = rows.select_columns(&all);
            for (r, wire) in wires.iter().enumerate() {
                let own = |k: usize| (k % 3 == usize::from(*wire), bits[r * words + k / 64] >> (k % 64) & 1 == 1);
                let expected = |k: usize| if own(k).0 { if own(k).1 { 1.0 } else { -1.0 } } else { 0.0 };
                assert!((0..ncols).all(|k| (dense.row(r)[k] - expected(k)).abs() < 1e-15));
            }
            let y: Vec<f64> = (0..8).map(|k| f64::from(k).cos()).collect();
            let (mut back, mut wanted) = (vec![0.0; ncols], vec![0.0; ncols]);
            rows.apply_adjoint(&y, &mut back);
            dense.apply_adjoint(&y, &mut wanted);
            assert!(back.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-12));
            rows.chance_variance(&y, &mut back);
            dense.view().chance_variance(&y, &mut wanted);
            assert!(back.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-12));
            let (mut part, mut y) = (vec![0.0; 3], vec![0.0; 8]);
            rows.part(4..7).apply(&back, &mut part);
            dense.apply(&back, &mut y);
            assert!(part.iter().zip(&y[4..7]).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
