//! Rows of Φ·D for ±1 weights Φ, by look-up instead of multiplication.

use crate::matrix::MatrixView;
use crate::table_kernels::{self, ENTRIES, GROUP};

/// Precision of the tables: `f64`, or `f32` for half the memory traffic.
pub trait TableFloat: Copy + Send + Sync + table_kernels::Gather {}

impl TableFloat for f32 {}
impl TableFloat for f64 {}

/// Tables of Σₖ ±D\[k\] over groups of 8 rows of a dictionary D (N × K): a row of Φ·D is then the sum of ⌈N/8⌉ table rows, N/8 additions
/// an atom instead of N multiplications and additions.
///
/// Memory: 256·⌈N/8⌉·K numbers; N = K = 100 takes 2.7 MB in `f64`, 1.3 MB in `f32`. With `f32` the sums are `f32` as well, and a row is
/// exact to ⌈N/8⌉·6e-8 of the sum of magnitudes in its column, far below what a measurement resolves.
/// The idea is the "method of four Russians": V. L. Arlazarov et al., Dokl. Akad. Nauk SSSR 194 (1970).
#[derive(Debug, Clone)]
pub struct SignTables<T> {
    nrows: usize,
    ncols: usize,
    /// Group after group, sign pattern after sign pattern, K numbers each.
    values: Vec<T>,
}

impl<T: TableFloat> SignTables<T> {
    /// Tables of `dictionary` (N × K).
    #[must_use]
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

    /// Number of rows N of the dictionary: weights of a row of Φ.
    #[must_use]
    pub fn nrows(&self) -> usize {
        self.nrows
    }

    /// Number of atoms K.
    #[must_use]
    pub fn ncols(&self) -> usize {
        self.ncols
    }

    /// Words of 64 signs that a row of Φ takes: ⌈N/64⌉.
    #[must_use]
    pub fn words(&self) -> usize {
        self.nrows.div_ceil(64)
    }

    /// Writes φᵀ D for one row φ after the other: bit k of a row (bit k mod 64 of its word ⌊k/64⌋) is set where φₖ = +1 and clear where
    /// φₖ = −1. `signs` holds [`Self::words`] words a row; bits past N do not matter. `out` is row-major with K numbers a row.
    ///
    /// # Panics
    /// When `signs` and `out` do not hold the same whole number of rows.
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

/// The [`ENTRIES`] sums of the group that starts with row `first`: all signs negative first, then each pattern from the one without
/// its highest bit by adding 2·D of that row.
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

/// Rows of Φ·D that are ready before the samples are measured with them: the signs of a row do not depend on the data.
///
/// Holds the last `capacity` rows one after the other, so that a window of consecutive measurements is a matrix without copying.
#[derive(Debug, Clone)]
pub struct RowCache<'a, T> {
    tables: &'a SignTables<T>,
    capacity: usize,
    /// Twice the capacity: rows move to the front once in `capacity` pushes.
    values: Vec<f64>,
    /// Rows in `values`.
    len: usize,
}

impl<'a, T: TableFloat> RowCache<'a, T> {
    /// Empty cache of the last `capacity` rows, at least 1.
    #[must_use]
    pub fn new(tables: &'a SignTables<T>, capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self {
            tables,
            capacity,
            values: vec![0.0; 2 * capacity * tables.ncols],
            len: 0,
        }
    }

    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Rows held.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len.min(self.capacity)
    }

    /// True when there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Forms the row with `signs` as in [`SignTables::fill_rows`]; the oldest row goes when the cache is full.
    ///
    /// # Panics
    /// When `signs` is not one row.
    pub fn push(&mut self, signs: &[u64]) {
        let k = self.tables.ncols;
        if self.len == 2 * self.capacity {
            // the newest `capacity` − 1 rows stay
            self.values.copy_within((self.capacity + 1) * k.., 0);
            self.len = self.capacity - 1;
        }
        let row = &mut self.values[self.len * k..(self.len + 1) * k];
        self.tables.fill_rows(signs, row);
        self.len += 1;
    }

    /// The newest `nrows` rows, oldest first: the operator of a window that ends with the newest measurement. `None` when the cache
    /// does not hold that many.
    #[must_use]
    pub fn window(&self, nrows: usize) -> Option<MatrixView<'_>> {
        let k = self.tables.ncols;
        let start = (nrows <= self.len()).then(|| self.len - nrows)?;
        MatrixView::new(nrows, k, &self.values[start * k..self.len * k]).ok()
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
            let phi: Vec<f64> = (0..d.nrows())
                .map(|i| if signs[i / 64] >> (i % 64) & 1 == 1 { 1.0 } else { -1.0 })
                .collect();
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
    fn the_cache_holds_the_newest_rows() {
        let (n, k, capacity) = (70, 5, 4);
        let (d, signs) = random(n, k, 2 * 30);
        let tables = SignTables::<f64>::new(d.view());
        let mut rows = vec![0.0; 30 * k];
        tables.fill_rows(&signs, &mut rows);
        let mut cache = RowCache::new(&tables, capacity);
        assert!(cache.is_empty() && cache.window(1).is_none());
        for (r, signs) in signs.chunks(2).enumerate() {
            cache.push(signs);
            assert_eq!(cache.len(), (r + 1).min(capacity));
            for m in 0..=cache.len() {
                let window = cache.window(m).unwrap();
                assert_eq!(
                    window.values(),
                    &rows[(r + 1 - m) * k..(r + 1) * k],
                    "row {r}, window {m}"
                );
            }
            assert!(cache.window(cache.len() + 1).is_none());
        }
    }

    #[test]
    fn a_dictionary_without_atoms_has_empty_rows() {
        let tables = SignTables::<f64>::new(Matrix::zeros(9, 0).view());
        tables.fill_rows(&[1, 2], &mut []);
        let mut cache = RowCache::new(&tables, 0);
        cache.push(&[3]);
        assert_eq!(cache.window(1).map(MatrixView::nrows), Some(1));
    }
}
