//! Rows of Φ·D for ±1 weights Φ, by table look-up instead of multiplication.

use crate::matrix::MatrixView;
use multiversion::multiversion;

/// Precision of the tables, with its own compiled loop: `f64`, or `f32` with half the memory traffic.
pub trait TableFloat: Copy + Default + Into<f64> + std::ops::AddAssign + Send + Sync {
    /// The nearest number of this precision.
    fn nearest(value: f64) -> Self;

    /// Rows of Φ·D from tables: `words` words of `signs` and `ncols` numbers of `out` each, `groups` look-ups a row.
    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]);
}

/// Tables of Σₖ ±D\[k\] over groups of 8 rows of a dictionary D (N × K). A row of Φ·D is then the sum of ⌈N/8⌉ table
/// rows: N/8 additions for each atom instead of N multiplications and additions.
///
/// Memory: 256·⌈N/8⌉·K numbers; N = K = 100 takes 2.7 MB in `f64` and 1.3 MB in `f32`. With `f32` the sums are also
/// `f32`, and the error of a row is at most ⌈N/8⌉·6e-8 of the sum of magnitudes in its column, far below the resolution
/// of a measurement. The idea is the "method of four Russians": V. L. Arlazarov et al., Dokl. Akad. Nauk SSSR 194
/// (1970).
///
/// ```
/// use spts_recon::{Matrix, SignTables};
///
/// let dictionary = Matrix::from_rows(3, 1, vec![1.0, 2.0, 4.0])?;
/// let tables = SignTables::<f64>::new(dictionary.view());
/// let mut row = [0.0];
/// tables.fill_rows(&[0b101], &mut row); // the signs +, −, +
/// assert_eq!(row, [1.0 - 2.0 + 4.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct SignTables<T> {
    nrows: usize,
    ncols: usize,
    /// Ordered by group, then by sign pattern, with K numbers each.
    values: Vec<T>,
}

impl<T: TableFloat> SignTables<T> {
    /// How many numbers the tables of a dictionary of N × K have.
    pub fn entries(nrows: usize, ncols: usize) -> f64 {
        (nrows.div_ceil(GROUP) * ENTRIES) as f64 * ncols as f64
    }

    /// Tables of `dictionary` (N × K).
    pub fn new(dictionary: MatrixView<'_>) -> Self {
        let (nrows, ncols) = (dictionary.nrows(), dictionary.ncols());
        let mut values = Vec::with_capacity(nrows.div_ceil(GROUP) * ENTRIES * ncols);
        let mut sums = vec![0.0; ENTRIES * ncols];
        for first in (0..nrows).step_by(GROUP) {
            fill_group(dictionary, first, &mut sums);
            values.extend(sums.iter().map(|&v| T::nearest(v)));
        }
        Self { nrows, ncols, values }
    }

    /// Number of 64-bit words for the signs of a row of Φ: ⌈N/64⌉.
    pub fn words(&self) -> usize {
        self.nrows.div_ceil(64)
    }

    /// Computes φᵀ D for consecutive rows φ. Bit k of a row (bit k mod 64 of its word ⌊k/64⌋) is set if φₖ = +1 and
    /// clear if φₖ = −1. `signs` holds [`Self::words`] words for each row; bits after N are ignored. `out` is row-major
    /// with K numbers for each row.
    ///
    /// # Panics
    /// If `signs` and `out` do not hold the same whole number of rows.
    pub fn fill_rows(&self, signs: &[u64], out: &mut [f64]) {
        let words = self.words().max(1);
        assert!(
            signs.len().is_multiple_of(words) && signs.len() / words * self.ncols == out.len(),
            "{} words of signs and {} numbers do not hold the same rows of {words} words and {} numbers",
            signs.len(),
            out.len(),
            self.ncols
        );
        if self.ncols > 0 {
            T::gather(&self.values, signs, words, self.nrows.div_ceil(GROUP), self.ncols, out);
        }
    }
}

/// The [`ENTRIES`] sums of the group that starts with row `first`: all signs negative first, then each pattern from the
/// one without its highest bit by adding 2·D of that row.
fn fill_group(dictionary: MatrixView<'_>, first: usize, sums: &mut [f64]) {
    let k = dictionary.ncols();
    let row = |bit: usize| {
        let r = first + bit;
        (r < dictionary.nrows()).then(|| dictionary.rows(r, 1).values())
    };
    sums[..k].fill(0.0);
    for values in (0..GROUP).filter_map(row) {
        sums[..k].iter_mut().zip(values).for_each(|(s, v)| *s -= v);
    }
    for bit in 0..GROUP {
        let (known, rest) = sums.split_at_mut((1 << bit) * k);
        let next = &mut rest[..known.len()];
        next.copy_from_slice(known);
        if let Some(values) = row(bit) {
            for entry in next.chunks_exact_mut(k.max(1)) {
                entry.iter_mut().zip(values).for_each(|(s, v)| *s += 2.0 * v);
            }
        }
    }
}

/// Weights of one look-up: the bits of a byte.
const GROUP: usize = 8;

/// Table rows of one group of weights.
const ENTRIES: usize = 1 << GROUP;

/// Sums `B` columns from `c` of the table rows that the bytes of `signs` choose.
#[inline(always)]
fn block<T: TableFloat, const B: usize>(values: &[T], signs: &[u64], groups: usize, ncols: usize, c: usize) -> [T; B] {
    let mut sums = [T::default(); B];
    for (group, table) in values.chunks_exact(ENTRIES * ncols).take(groups).enumerate() {
        let byte = (signs[group / 8] >> (8 * (group % 8))) & 0xff;
        let start = byte as usize * ncols + c;
        if let Some(row) = table.get(start..).and_then(<[T]>::first_chunk::<B>) {
            for (sum, &v) in sums.iter_mut().zip(row) {
                *sum += v;
            }
        }
    }
    sums
}

/// Rows of Φ·D: `words` words of `signs` and `ncols` numbers of `out` each.
#[inline(always)]
fn gather_of<T: TableFloat>(values: &[T], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    for (signs, out) in signs.chunks_exact(words).zip(out.chunks_exact_mut(ncols)) {
        let mut c = 0;
        let (wide, rest) = out.as_chunks_mut::<64>();
        for out in wide {
            *out = block::<T, 64>(values, signs, groups, ncols, c).map(Into::into);
            c += 64;
        }
        let (blocks, rest) = rest.as_chunks_mut::<32>();
        for out in blocks {
            *out = block::<T, 32>(values, signs, groups, ncols, c).map(Into::into);
            c += 32;
        }
        let (fours, rest) = rest.as_chunks_mut::<4>();
        for out in fours {
            *out = block::<T, 4>(values, signs, groups, ncols, c).map(Into::into);
            c += 4;
        }
        for out in rest {
            [*out] = block::<T, 1>(values, signs, groups, ncols, c).map(Into::into);
            c += 1;
        }
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn gather_f32(values: &[f32], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    gather_of(values, signs, words, groups, ncols, out);
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn gather_f64(values: &[f64], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    gather_of(values, signs, words, groups, ncols, out);
}

impl TableFloat for f32 {
    #[expect(clippy::cast_possible_truncation, reason = "rounding is what is asked for")]
    fn nearest(value: f64) -> Self {
        value as Self
    }

    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
        gather_f32(values, signs, words, groups, ncols, out);
    }
}

impl TableFloat for f64 {
    fn nearest(value: f64) -> Self {
        value
    }

    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
        gather_f64(values, signs, words, groups, ncols, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    fn random(n: usize, k: usize, words: usize) -> (Matrix, Vec<u64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let d = Matrix::from_rows(n, k, (0..n * k).map(|_| rng.random_range(-1.0..1.0)).collect()).unwrap();
        (d, (0..words).map(|_| rng.random()).collect())
    }

    fn products(d: &Matrix, signs: &[u64]) -> Vec<f64> {
        let mut out = Vec::new();
        for signs in signs.chunks(d.nrows().div_ceil(64)) {
            let phi: Vec<f64> =
                (0..d.nrows()).map(|i| if signs[i / 64] >> (i % 64) & 1 == 1 { 1.0 } else { -1.0 }).collect();
            let mut row = vec![0.0; d.ncols()];
            d.accumulate_row(&phi, &mut row);
            out.extend(row);
        }
        out
    }

    /// N numbers below 1: any order of additions is within N roundings of N; the tables take up to 2·8 roundings more.
    fn assert_rows<T: TableFloat>(epsilon: f64) {
        for (n, k) in [(1, 1), (8, 3), (63, 8), (64, 40), (65, 33), (100, 100), (130, 7)] {
            let (d, signs) = random(n, k, 9 * n.div_ceil(64));
            let tables = SignTables::<T>::new(d.view());
            let mut out = vec![f64::NAN; 9 * k];
            tables.fill_rows(&signs, &mut out);
            let size = n as f64 + 16.0;
            for (got, expected) in out.iter().zip(products(&d, &signs)) {
                let error = (got - expected).abs();
                assert!(error <= size * size * epsilon, "{n} × {k}: {got}, expected {expected}");
            }
        }
    }

    #[test]
    fn rows_are_products_with_the_dictionary() {
        assert_rows::<f64>(f64::EPSILON);
        assert_rows::<f32>(f64::from(f32::EPSILON));
    }

    #[test]
    fn a_dictionary_without_atoms_has_empty_rows() {
        let tables = SignTables::<f64>::new(Matrix::zeros(9, 0).view());
        tables.fill_rows(&[1, 2], &mut []);
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (groups, words, ncols) = (9, 2, 71);
        let values: Vec<f64> = (0..groups * ENTRIES * ncols).map(|i| (0.37 * i as f64).sin()).collect();
        let signs = [0x0123_4567_89ab_cdef, 0xfe, 0xf0f0_0f0f_aa55_1234, 0x3c];
        let (mut chosen, mut plain) = (vec![f64::NAN; 2 * ncols], vec![f64::NAN; 2 * ncols]);
        f64::gather(&values, &signs, words, groups, ncols, &mut chosen);
        gather_of(&values, &signs, words, groups, ncols, &mut plain);
        assert!(chosen.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()));
        let values: Vec<f32> = values.iter().map(|&v| f32::nearest(v)).collect();
        f32::gather(&values, &signs, words, groups, ncols, &mut chosen);
        gather_of(&values, &signs, words, groups, ncols, &mut plain);
        assert!(chosen.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
