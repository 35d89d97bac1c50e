//! The ±1 weights of consecutive measurements as packed columns, and least squares with them.

use nalgebra::{DMatrix, DVector};
use spts_circuit::{WeightMode, WeightRows};

/// A cell that runs with a seed other than its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Reseeded {
    /// Taxel, from 0, row-major.
    pub taxel: u32,
    /// Seed of its generator.
    pub seed: u32,
}

/// Columns of ±1, one bit a measurement: every taxel, then the constant, then the parity of the row.
///
/// Products of such columns are counts of equal bits: aᵀb = n − 2·popcount(a ⊕ b).
#[derive(Debug, Clone)]
pub(crate) struct Design {
    len: usize,
    words: usize,
    columns: Vec<u64>,
    count: usize,
}

impl Design {
    /// Columns of the measurements of `weights`; `parity` adds the column that alternates with the row. `None` for
    /// weights that are not binary.
    pub(super) fn new(weights: WeightRows<'_>, reseeded: &[Reseeded], parity: bool) -> Option<Self> {
        let (taxels, first_row, len) = (weights.taxels(), weights.first_row(), weights.len());
        let words = len.div_ceil(64);
        let count = taxels + 1 + usize::from(parity);
        let mut columns = vec![0_u64; words * count];
        let row_words = taxels.div_ceil(64).max(1);
        let rows = weights.sign_bits()?;
        for (i, row) in rows.chunks_exact(row_words).enumerate() {
            for k in 0..taxels {
                columns[k * words + i / 64] |= (row[k / 64] >> (k % 64) & 1) << (i % 64);
            }
        }
        let mut design = Self {
            len,
            words,
            columns,
            count,
        };
        for cell in reseeded {
            design.fill(cell.taxel as usize, |i| {
                WeightMode::Binary.level_from_seed(cell.seed, first_row + i as u64) > 0.0
            });
        }
        design.fill(taxels, |_| true);
        if parity {
            design.fill(taxels + 1, |i| (first_row + i as u64).is_multiple_of(2));
        }
        Some(design)
    }

    fn fill(&mut self, column: usize, is_plus: impl Fn(usize) -> bool) {
        let bits = &mut self.columns[column * self.words..(column + 1) * self.words];
        bits.fill(0);
        for i in (0..self.len).filter(|i| is_plus(*i)) {
            bits[i / 64] |= 1 << (i % 64);
        }
    }

    /// Number of measurements.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        self.count
    }

    fn column(&self, k: usize) -> &[u64] {
        &self.columns[k * self.words..(k + 1) * self.words]
    }

    /// True where taxel `k` has weight +1 at measurement `i`.
    #[inline]
    pub(super) fn is_plus(&self, k: usize, i: usize) -> bool {
        self.columns[k * self.words + i / 64] >> (i % 64) & 1 == 1
    }

    /// Σₖ coefficientsₖ·columnₖ; fewer coefficients than columns leave the last columns out.
    pub(super) fn apply(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.len];
        for (k, &c) in coefficients.iter().enumerate() {
            for (chunk, word) in out.chunks_mut(64).zip(self.column(k)) {
                for (i, v) in chunk.iter_mut().enumerate() {
                    *v += signed(c, word >> i & 1);
                }
            }
        }
        out
    }

    /// Coefficients with the least Σ (y − Φ·coefficients)² over the measurements that are `kept`; `None` when these do
    /// not determine them.
    pub(super) fn solve(&self, y: &[f64], kept: &[bool]) -> Option<Vec<f64>> {
        let mut mask = vec![0_u64; self.words];
        for i in (0..self.len).filter(|i| kept[*i]) {
            mask[i / 64] |= 1 << (i % 64);
        }
        let count = |bits: &mut dyn Iterator<Item = u64>| bits.map(|w| f64::from(w.count_ones())).sum::<f64>();
        let n = count(&mut mask.iter().copied());
        let gram = DMatrix::from_fn(self.count, self.count, |i, j| {
            if j > i {
                return 0.0;
            }
            let pairs = self.column(i).iter().zip(self.column(j)).zip(&mask);
            n - 2.0 * count(&mut pairs.map(|((a, b), m)| (a ^ b) & m))
        });
        let kept_y: Vec<f64> = y.iter().zip(kept).map(|(v, k)| if *k { *v } else { 0.0 }).collect();
        let moments = DVector::from_fn(self.count, |k, _| self.dot(k, &kept_y));
        // only the lower triangle is read
        Some(gram.cholesky()?.solve(&moments).as_slice().to_vec())
    }

    /// columnₖ · y.
    fn dot(&self, k: usize, y: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (chunk, word) in y.chunks(64).zip(self.column(k)) {
            for (i, v) in chunk.iter().enumerate() {
                sum += signed(*v, word >> i & 1);
            }
        }
        sum
    }
}

/// `v` where the bit is 1, −`v` where it is 0.
#[inline]
fn signed(v: f64, bit: u64) -> f64 {
    f64::from_bits(v.to_bits() ^ ((bit ^ 1) << 63))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Seeding, Weights};

    /// A noiseless run gives its image back, whatever measurements are left out, as long as enough are left.
    #[test]
    fn an_exact_run_is_solved_exactly() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design = Design::new(
            WeightRows::new(&weights, 12_345, 1000),
            &[Reseeded { taxel: 7, seed: 2 }],
            true,
        )
        .unwrap();
        let image: Vec<f64> = (0..102).map(|k| f64::from(k % 7) * 0.1 - 0.2).collect();
        let y = design.apply(&image);
        let kept: Vec<bool> = (0..1000).map(|i| i % 5 != 3).collect();
        let found = design.solve(&y, &kept).unwrap();
        // condition number of 800 near-orthogonal rows below 10, sums of 1000 terms below 10: 1e-11 is a hundred times
        // that
        for (a, b) in found.iter().zip(&image) {
            assert!((a - b).abs() < 1e-11, "{a} against {b}");
        }
        // the packed columns are the weights themselves
        for (k, i) in [(0, 0), (99, 999), (50, 64)] {
            assert_eq!(
                design.is_plus(k, i),
                weights.level(u32::try_from(k).unwrap(), 12_345 + i as u64) > 0.0
            );
        }
        assert_eq!(
            design.is_plus(7, 5),
            WeightMode::Binary.level_from_seed(2, 12_350) > 0.0
        );
    }

    #[test]
    fn too_few_measurements_determine_nothing() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design = Design::new(WeightRows::new(&weights, 0, 90), &[], false).unwrap();
        assert!(design.solve(&[0.0; 90], &[true; 90]).is_none());
    }
}
