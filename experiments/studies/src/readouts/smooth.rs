//! Linear images of smooth contacts from rows that are products along the two axes.

use super::error::ReadoutsError;
use super::rows::StoredRows;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Noise of a measurement as a share of the root mean square of a random row's sum: that which the rows are designed
/// for.
const NOISE: f64 = spts_recon::rows::RowTask::NOISE;

/// The Gaussian estimate x̂ = C Φᵀ (Φ C Φᵀ + σ²)⁻¹ y with C = A ⊗ B, Cᵢⱼ = exp(−d²/2ℓ²) along either axis, for rows
/// Φᵢ = aᵢ ⊗ bᵢ: no matrix is larger than M × M, so that skins of any size have it. Negative values are set to 0.
#[derive(Debug, Clone)]
pub(super) struct SmoothEstimate {
    /// A aᵢ and B bᵢ of every row.
    images: Vec<[Vec<f64>; 2]>,
    system: Cholesky<f64, Dyn>,
}

impl SmoothEstimate {
    /// The estimate from the first `count` of `rows` on a skin of `shape`, for images that are alike over `length`
    /// taxels.
    pub(super) fn new(rows: &StoredRows, shape: [usize; 2], count: usize, length: f64) -> Result<Self, ReadoutsError> {
        let smoothed = |v: &[f64]| -> Vec<f64> {
            let weight = |i: usize, j: usize| (-0.5 * (i.abs_diff(j) as f64 / length).powi(2)).exp();
            (0..v.len())
                .map(|i| v.iter().enumerate().map(|(j, v)| weight(i, j) * v).sum())
                .collect()
        };
        let factors: Vec<[Vec<f64>; 2]> = (0..count).map(|r| factors(rows.row(r), shape)).collect();
        let images: Vec<[Vec<f64>; 2]> = factors.iter().map(|[a, b]| [smoothed(a), smoothed(b)]).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let variance = NOISE * NOISE * (shape[0] * shape[1]) as f64;
        let system = DMatrix::from_fn(count, count, |i, j| {
            let product = dot(&factors[i][0], &images[j][0]) * dot(&factors[i][1], &images[j][1]);
            product + if i == j { variance } else { 0.0 }
        });
        let system = Cholesky::new(system).ok_or(ReadoutsError::Singular { rows: count })?;
        Ok(Self { images, system })
    }

    /// The image, in the unit of the samples.
    pub(super) fn image(&self, samples: &[f64]) -> Vec<f64> {
        let shares = self.system.solve(&DVector::from_column_slice(samples));
        let cols = self.images.first().map_or(0, |[_, b]| b.len());
        let rows = self.images.first().map_or(0, |[a, _]| a.len());
        let mut image = vec![0.0; rows * cols];
        for ([a, b], share) in self.images.iter().zip(shares.iter()) {
            for (line, a) in image.chunks_exact_mut(cols.max(1)).zip(a) {
                line.iter_mut().zip(b).for_each(|(v, b)| *v += share * a * b);
            }
        }
        image.iter_mut().for_each(|v| *v = v.max(0.0));
        image
    }
}

/// a and b of a row a ⊗ b of signs.
fn factors(row: &[i8], [rows, cols]: [usize; 2]) -> [Vec<f64>; 2] {
    let first = f64::from(row[0]);
    let down = (0..rows).map(|r| f64::from(row[r * cols]) * first).collect();
    let across = row[..cols].iter().map(|w| f64::from(*w)).collect();
    [down, across]
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_recon::Matrix;
    use spts_recon::recover::{Fixed, Gaussian, Noise};
    use spts_recon::rows::{DesignRows as _, Expected, RowTask, Separable};
    use std::sync::Arc;

    /// Against the dense estimate, which solves the same equations with the whole covariance.
    #[test]
    fn the_estimate_is_the_dense_one() {
        let (shape, length) = ([6, 5], 1.5);
        let expected = Expected::smooth(shape, length).unwrap();
        let designed = Separable.design(&RowTask::new(9, &expected)).unwrap();
        let signs = designed
            .view()
            .values()
            .iter()
            .map(|w| if *w > 0.0 { 1 } else { -1 })
            .collect();
        let rows = StoredRows::new(30, signs);
        let samples: Vec<f64> = (0..9).map(|i| 3.0 + f64::from(i * i % 7)).collect();
        let found = SmoothEstimate::new(&rows, shape, 9, length).unwrap().image(&samples);

        let alike = |k: usize, l: usize| {
            let square = |a: usize, b: usize| (a.abs_diff(b) as f64 / length).powi(2);
            (-0.5 * (square(k / 5, l / 5) + square(k % 5, l % 5))).exp()
        };
        let covariance = (0..900)
            .map(|e| alike(e / 30, e % 30) + if e / 30 == e % 30 { 1e-9 } else { 0.0 })
            .collect();
        let prior = Gaussian::new(vec![0.0; 30], Matrix::from_rows(30, 30, covariance).unwrap()).unwrap();
        let noise = Noise::Absolute(NOISE * 30.0_f64.sqrt());
        let fixed = Fixed::new(designed.view(), Arc::new(prior), noise).unwrap();
        let mut window = fixed.window();
        window.extend(&samples);
        for (found, dense) in found.iter().zip(window.image().unwrap()) {
            // the dense covariance has a floor of 1e-9, and images of order 1
            assert!((found - dense.max(0.0)).abs() < 1e-5, "{found} against {dense}");
        }
    }
}
