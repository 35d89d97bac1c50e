//! Gaussian priors of large sheets, stored as two small matrices.

use crate::kernels::axpy;
use crate::matrix::Matrix;
use crate::recover::{ParameterError, PriorError};

/// Share of the variance that every taxel has for itself at least: keeps factors of the covariance positive.
const FLOOR: f64 = 1e-3;

/// Gaussian prior x ~ N(0, A ⊗ B) of images on a grid of R × C taxels: A (R × R) along rows and B (C × C) along
/// columns, both with 1 on the diagonal. The scale of the images is not specified.
///
/// ```
/// use spts_recon::matrix_free::SheetPrior;
///
/// let prior = SheetPrior::smooth([100, 200], 3.0)?;
/// assert_eq!(prior.taxels(), 20_000);
/// assert!((prior.covariance(0, 3) - (-0.5_f64).exp()).abs() < 1e-3, "3 taxels apart in a row");
/// # Ok::<(), spts_recon::recover::PriorError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SheetPrior {
    rows: Matrix,
    cols: Matrix,
}

impl SheetPrior {
    /// Prior of images on a grid of `shape` = [rows, columns] that are smooth over `length` taxels: the covariance of
    /// two taxels at distance d is exp(−d²/2ℓ²).
    ///
    /// # Errors
    /// [`PriorError`] for an empty grid, or if `length` is outside [0.01, 1000].
    pub fn smooth(shape: [usize; 2], length: f64) -> Result<Self, PriorError> {
        if !(0.01..=1000.0).contains(&length) {
            return Err(PriorError::Parameter(ParameterError {
                field: "length",
                value: length,
                range: "[0.01, 1000]",
            }));
        }
        check_shape(shape, 1)?;
        let lags = |n: usize| (0..n).map(|d| (-0.5 * (d as f64 / length).powi(2)).exp()).collect();
        Ok(Self::stationary(shape.map(lags)))
    }

    /// Prior of images on a grid of `shape` = [rows, columns] that resemble `images` (row-major), at any position. The
    /// covariance along an axis is the mean product of two taxels at a distance, divided by the mean square. Every
    /// image counts equally, whatever its scale; images that are zero are ignored.
    ///
    /// # Errors
    /// [`PriorError::Images`] if every image is zero, or one does not fit the grid.
    pub fn like<'a>(images: impl IntoIterator<Item = &'a [f64]>, shape: [usize; 2]) -> Result<Self, PriorError> {
        let [rows, cols] = shape;
        check_shape(shape, 0)?;
        let mut sums = shape.map(|n| vec![0.0; n]);
        let mut count = 0;
        for image in images {
            if image.len() != rows * cols {
                return Err(of_images(count, image.len(), cols));
            }
            let square: f64 = image.iter().map(|v| v * v).sum();
            if !(square > 0.0 && square.is_finite()) {
                continue;
            }
            count += 1;
            let touched: Vec<usize> = (0..image.len()).filter(|k| image[*k] != 0.0).collect();
            for &k in &touched {
                let (r, c) = (k / cols, k % cols);
                for d in 0..rows - r {
                    sums[0][d] += image[k] * image[k + d * cols] / square;
                }
                for d in 0..cols - c {
                    sums[1][d] += image[k] * image[k + d] / square;
                }
            }
        }
        if count == 0 {
            return Err(of_images(0, rows * cols, cols));
        }
        Ok(Self::stationary(sums))
    }

    /// Covariances that depend on the distance alone, from their values at all distances.
    fn stationary(lags: [Vec<f64>; 2]) -> Self {
        let [rows, cols] = lags.map(|lags| {
            let n = lags.len();
            let mut c = Matrix::zeros(n, n);
            for i in 0..n {
                for (j, v) in c.row_mut(i).iter_mut().enumerate() {
                    *v = if i == j {
                        1.0
                    } else {
                        (1.0 - FLOOR) * lags[i.abs_diff(j)] / lags[0]
                    };
                }
            }
            c
        });
        Self { rows, cols }
    }

    /// Rows and columns of the grid.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        [self.rows.nrows(), self.cols.nrows()]
    }

    /// Number of taxels, N.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.rows.nrows() * self.cols.nrows()
    }

    /// Covariance of two taxels.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let cols = self.cols.nrows();
        self.rows.row(i / cols)[j / cols] * self.cols.row(i % cols)[j % cols]
    }

    /// C x, as A X B with the image X as a grid; O(N (R + C)), and rows of X that are zero cost nothing.
    pub(super) fn apply(&self, x: &[f64]) -> Vec<f64> {
        let cols = self.cols.nrows();
        let mut out = vec![0.0; x.len()];
        let mut along = vec![0.0; cols];
        for (r, part) in x.chunks_exact(cols).enumerate() {
            if part.iter().all(|v| *v == 0.0) {
                continue;
            }
            along.fill(0.0);
            for (c, v) in part.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                axpy(*v, self.cols.row(c), &mut along);
            }
            for (share, out) in self.rows.row(r).iter().zip(out.chunks_exact_mut(cols)) {
                axpy(*share, &along, out);
            }
        }
        out
    }
}

fn of_images(images: usize, pixels: usize, cols: usize) -> PriorError {
    PriorError::Images { images, pixels, cols }
}

fn check_shape([rows, cols]: [usize; 2], images: usize) -> Result<(), PriorError> {
    if rows.checked_mul(cols).is_none_or(|taxels| taxels == 0) {
        return Err(of_images(images, 0, cols));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_is_that_of_the_whole_covariance() {
        let prior = SheetPrior::smooth([4, 5], 1.3).unwrap();
        let x: Vec<f64> = (0..20).map(|k| f64::from((k * 7 + 3) % 11) - 5.0).collect();
        let out = prior.apply(&x);
        for (i, found) in out.iter().enumerate() {
            let expected: f64 = (0..20).map(|j| prior.covariance(i, j) * x[j]).sum();
            assert!((found - expected).abs() < 1e-12, "{i}: {found} {expected}");
        }
    }

    /// Two neighbours of equal size in a row: at a distance of one column half of the squares, at any other nothing.
    #[test]
    fn a_prior_is_like_its_images() {
        let mut image = vec![0.0; 12];
        (image[5], image[6]) = (3.0, 3.0);
        let zero = vec![0.0; 12];
        let prior = SheetPrior::like([image.as_slice(), &zero], [3, 4]).unwrap();
        assert!((prior.covariance(0, 1) - 0.5 * (1.0 - FLOOR)).abs() < 1e-15);
        assert!((prior.covariance(5, 5) - 1.0).abs() < 1e-15);
        assert!(prior.covariance(0, 4).abs() + prior.covariance(0, 2).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_prior_is_refused() {
        assert!(SheetPrior::smooth([0, 4], 1.0).is_err() && SheetPrior::smooth([2, 4], f64::NAN).is_err());
        let image = [1.0; 6];
        assert!(SheetPrior::like([image.as_slice()], [2, 2]).is_err());
        assert!(SheetPrior::like([[0.0; 4].as_slice()], [2, 2]).is_err());
        assert!(SheetPrior::like(std::iter::empty(), [2, 2]).is_err());
    }
}
