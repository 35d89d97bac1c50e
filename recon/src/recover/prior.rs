//! Gaussian priors of images.

use super::parameter::ParameterError;
use crate::kernels::dot;
use crate::matrix::Matrix;
use nalgebra::DMatrix;

/// Gaussian prior x ~ N(μ, C) of N unknowns.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::recover::Gaussian;
///
/// let covariance = Matrix::from_rows(2, 2, vec![1.0, 0.8, 0.8, 1.0])?; // neighbours are alike
/// let prior = Gaussian::new(vec![0.0; 2], covariance)?;
/// assert!((prior.precision().row(0)[0] - 1.0 / 0.36).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Gaussian {
    mean: Vec<f64>,
    covariance: Matrix,
    precision: Matrix,
    /// C⁻¹ μ
    natural: Vec<f64>,
}

/// Why mean and covariance do not define a Gaussian.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PriorError {
    /// The size of the covariance does not match the mean.
    #[error("covariance has shape {rows} × {cols} but `mean` has {len} entries")]
    Shape {
        /// Rows of the covariance.
        rows: usize,
        /// Columns of the covariance.
        cols: usize,
        /// Length of the mean.
        len: usize,
    },
    /// An entry of mean or covariance is NaN or infinite.
    #[error("`{field}` holds a value that is not finite")]
    NotFinite {
        /// `mean` or `covariance`.
        field: &'static str,
    },
    /// C ≠ Cᵀ.
    #[error("covariance[{row}, {col}] = {value} but its mirror image is {mirror}")]
    NotSymmetric {
        /// Row.
        row: usize,
        /// Column.
        col: usize,
        /// The entry.
        value: f64,
        /// The entry mirrored at the diagonal.
        mirror: f64,
    },
    /// The covariance has a direction without variance.
    #[error("covariance is not positive definite; a positive `floor` or noise makes it so")]
    NotPositiveDefinite,
    /// No image, or images that do not fit the grid.
    #[error("{images} images of {pixels} pixels do not make a prior on a grid of {cols} columns")]
    Images {
        /// Number of images.
        images: usize,
        /// Pixels an image.
        pixels: usize,
        /// Columns of the grid.
        cols: usize,
    },
    /// A parameter of the image prior is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// Rounding that a symmetric matrix may show across its diagonal, as a share of the entry's bound √(Cᵢᵢ Cⱼⱼ): sums of
/// some 10⁵ terms in different order.
const ASYMMETRY: f64 = 1e-10;

impl Gaussian {
    /// A prior with `mean` (length N) and `covariance` (N × N, positive definite).
    ///
    /// # Errors
    /// [`PriorError`] if they do not define a Gaussian.
    pub fn new(mean: Vec<f64>, covariance: Matrix) -> Result<Self, PriorError> {
        let n = mean.len();
        if n == 0 || covariance.nrows() != n || covariance.ncols() != n {
            return Err(PriorError::Shape {
                rows: covariance.nrows(),
                cols: covariance.ncols(),
                len: n,
            });
        }
        let values = covariance.view().values();
        for (field, values) in [("mean", mean.as_slice()), ("covariance", values)] {
            if !values.iter().all(|v| v.is_finite()) {
                return Err(PriorError::NotFinite { field });
            }
        }
        check_symmetry(&covariance)?;
        let dense = DMatrix::from_row_slice(n, n, values);
        let inverse = dense.cholesky().ok_or(PriorError::NotPositiveDefinite)?.inverse();
        if !inverse.iter().all(|v| v.is_finite()) {
            return Err(PriorError::NotPositiveDefinite);
        }
        let precision = Matrix::from(&inverse);
        let natural = (0..n).map(|i| dot(precision.row(i), &mean)).collect();
        Ok(Self {
            mean,
            covariance,
            precision,
            natural,
        })
    }

    /// A prior of `n` independent unknowns with mean 0 and standard deviation `deviation`.
    ///
    /// # Errors
    /// [`PriorError`] if `n` is 0, or `deviation` is outside (0, ∞).
    pub fn white(n: usize, deviation: f64) -> Result<Self, PriorError> {
        let mut covariance = Matrix::zeros(n, n);
        for i in 0..n {
            covariance.row_mut(i)[i] = deviation * deviation;
        }
        Self::new(vec![0.0; n], covariance)
    }

    /// Number of unknowns, N.
    pub(super) fn len(&self) -> usize {
        self.mean.len()
    }

    /// Mean μ, length N.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Covariance C, N × N.
    #[must_use]
    pub fn covariance(&self) -> &Matrix {
        &self.covariance
    }

    /// C⁻¹ μ, length N: what the mean adds to the normal equations.
    pub(super) fn natural(&self) -> &[f64] {
        &self.natural
    }

    /// Inverse of the covariance, N × N.
    #[must_use]
    pub fn precision(&self) -> &Matrix {
        &self.precision
    }
}

fn check_symmetry(covariance: &Matrix) -> Result<(), PriorError> {
    for row in 0..covariance.nrows() {
        for col in 0..row {
            let (value, mirror) = (covariance.row(row)[col], covariance.row(col)[row]);
            let bound = (covariance.row(row)[row].abs() * covariance.row(col)[col].abs()).sqrt();
            if (value - mirror).abs() > ASYMMETRY * bound {
                return Err(PriorError::NotSymmetric {
                    row,
                    col,
                    value,
                    mirror,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_precision_is_the_inverse() {
        let covariance = Matrix::from_rows(2, 2, vec![2.0, 1.0, 1.0, 2.0]).unwrap();
        let prior = Gaussian::new(vec![0.0; 2], covariance).unwrap();
        for (got, expected) in prior.precision().view().values().iter().zip([2.0, -1.0, -1.0, 2.0]) {
            assert!((got - expected / 3.0).abs() < 1e-15);
        }
    }

    #[test]
    fn what_is_no_gaussian_is_refused() {
        let matrix = |v: [f64; 4]| Matrix::from_rows(2, 2, v.to_vec()).unwrap();
        let new = |mean: &[f64], v| Gaussian::new(mean.to_vec(), matrix(v)).unwrap_err();
        let unit = [1.0, 0.0, 0.0, 1.0];
        assert!(matches!(new(&[0.0], unit), PriorError::Shape { len: 1, .. }));
        assert!(matches!(
            new(&[f64::NAN, 0.0], unit),
            PriorError::NotFinite { field: "mean" }
        ));
        assert!(matches!(
            new(&[0.0; 2], [1.0, 0.5, 0.4, 1.0]),
            PriorError::NotSymmetric { row: 1, col: 0, .. }
        ));
        assert_eq!(new(&[0.0; 2], [1.0, 2.0, 2.0, 1.0]), PriorError::NotPositiveDefinite);
        assert_eq!(Gaussian::white(2, 0.0).unwrap_err(), PriorError::NotPositiveDefinite);
    }
}
