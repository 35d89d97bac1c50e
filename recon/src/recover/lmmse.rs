//! Linear minimum mean-square error estimate under a Gaussian prior.

use super::cholesky;
use super::cholesky::NotPositiveDefinite;
use super::gaussian::{GaussianScratch, Model};
use super::parameter::{Noise, ParameterError};
use super::prior::Gaussian;
use crate::kernels::{axpy, dot};
use crate::matrix::Matrix;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;
use std::sync::Arc;

/// Linear minimum mean-square error estimate of x from y = A x + n with x ~ N(μ, C) and n ~ N(0, σ² I), which is also
/// the mean of the Gaussian posterior:
///
/// x̂ = μ + C Aᵀ (A C Aᵀ + σ² I)⁻¹ (y − A μ) = μ + (Aᵀ A + σ² C⁻¹)⁻¹ Aᵀ (y − A μ); the smaller of the two systems is
/// solved.
///
/// Noise variances below 1e-12 ‖A‖² tr(C) / (M N) are raised to it.
/// Source: S. M. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory" (1993), §10.6 and §12.5.
#[derive(Debug, Clone)]
pub struct Lmmse {
    prior: Arc<Gaussian>,
    noise: Noise,
}

/// Gaussian posterior of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// Mean, length N: the estimate.
    pub mean: Vec<f64>,
    /// Covariance, N × N: C − C Aᵀ (A C Aᵀ + σ² I)⁻¹ A C.
    pub covariance: Matrix,
}

impl Lmmse {
    /// Estimate under `prior` for measurements with `noise`.
    ///
    /// # Errors
    /// [`ParameterError`] when `noise` is outside its range.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, ParameterError> {
        Ok(Self {
            prior,
            noise: noise.checked()?,
        })
    }

    /// Mean and covariance of x after the measurements.
    ///
    /// # Errors
    /// As [`Recover::recover`].
    pub fn posterior(&self, problem: &Problem<'_>, workspace: &mut Workspace) -> Result<Posterior, RecoverError> {
        let mut model = Model::new(problem, &self.prior, self.noise, workspace.scratch::<GaussianScratch>())?;
        let in_data_space = estimate(&mut model)?;
        let mean = model.work.x.clone();
        if let Some(atom) = mean.iter().position(|v| !v.is_finite()) {
            return Err(RecoverError::Overflow { atom });
        }
        let covariance = if in_data_space {
            reduced_covariance(&mut model)
        } else {
            inverse_covariance(&model)
        };
        Ok(Posterior { mean, covariance })
    }
}

impl Recover for Lmmse {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let mut model = Model::new(problem, &self.prior, self.noise, workspace.scratch::<GaussianScratch>())?;
        estimate(&mut model)?;
        let residual_norm = model.residual_norm();
        solution.set_dense(&model.work.x, 1.0, residual_norm)
    }
}

/// x̂ → `x`, and the factor of the system solved → `system`. True when that is the data-space system.
fn estimate(model: &mut Model<'_, '_>) -> Result<bool, RecoverError> {
    let in_data_space = model.m <= model.n;
    if in_data_space {
        model.data_space();
        let work = &mut *model.work;
        work.weights.clear();
        work.weights.extend_from_slice(&work.innovation);
    } else {
        model.parameter_space();
        model.project();
    }
    let (size, n, work) = (model.m.min(model.n), model.n, &mut *model.work);
    cholesky::factor(&mut work.system, size).map_err(not_positive_definite)?;
    cholesky::solve(&work.system, size, &mut work.weights);
    work.x.clear();
    work.x.extend_from_slice(model.prior.mean());
    if in_data_space {
        for (&weight, row) in work.weights.iter().zip(work.cross.chunks_exact(n)) {
            axpy(weight, row, &mut work.x);
        }
    } else {
        axpy(1.0, &work.weights, &mut work.x);
    }
    Ok(in_data_space)
}

fn not_positive_definite(error: NotPositiveDefinite) -> RecoverError {
    RecoverError::NotPositiveDefinite { pivot: error.pivot }
}

/// C − Wᵀ W with W = L⁻¹ A C and L the factor of the data-space system.
fn reduced_covariance(model: &mut Model<'_, '_>) -> Matrix {
    let (m, n, work) = (model.m, model.n, &mut *model.work);
    for i in 0..m {
        let (above, rest) = work.cross.split_at_mut(i * n);
        let row = &mut rest[..n];
        for (j, other) in above.chunks_exact(n).enumerate() {
            axpy(-work.system[i * m + j], other, row);
        }
        let pivot = work.system[i * m + i];
        row.iter_mut().for_each(|v| *v /= pivot);
    }
    let mut covariance = model.prior.covariance().clone();
    for row in work.cross.chunks_exact(n) {
        for (i, &v) in row.iter().enumerate() {
            axpy(-v, row, covariance.row_mut(i));
        }
    }
    covariance
}

/// σ² (Aᵀ A + σ² C⁻¹)⁻¹ from the factor of the parameter-space system: σ² Vᵀ V with V = L⁻¹.
fn inverse_covariance(model: &Model<'_, '_>) -> Matrix {
    let (n, factor) = (model.n, &model.work.system);
    let mut inverse = Matrix::zeros(n, n);
    for i in 0..n {
        // row i of the matrix holds column i of V
        let column = inverse.row_mut(i);
        column[i] = 1.0;
        cholesky::solve_lower(factor, n, column);
    }
    let mut covariance = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            covariance.row_mut(i)[j] = model.variance * dot(inverse.row(i), inverse.row(j));
        }
    }
    covariance
}
