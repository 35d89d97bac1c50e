//! Linear minimum mean-square error estimate under a Gaussian prior.

use super::cholesky;
use super::cholesky::NotPositiveDefinite;
use super::gaussian::{GaussianScratch, Model};
use super::parameter::{Noise, ParameterError};
use super::prior::Gaussian;
use crate::kernels::axpy;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;
use std::sync::Arc;

/// Linear minimum mean-square error estimate of x from y = A x + n with x ~ N(μ, C) and n ~ N(0, σ² I). It is also the
/// mean of the Gaussian posterior:
///
/// x̂ = μ + C Aᵀ (A C Aᵀ + σ² I)⁻¹ (y − A μ) = μ + (Aᵀ A + σ² C⁻¹)⁻¹ Aᵀ (y − A μ). The smaller of the two systems is
/// solved.
///
/// Noise variances below 1e-12 ‖A‖² tr(C) / (M N) are raised to that value.
/// Source: S. M. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory" (1993), §10.6 and §12.5.
///
/// ```
/// use spts_recon::recover::{Gaussian, Lmmse, Noise};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
/// use std::sync::Arc;
///
/// // two taxels that are alike; only their sum is measured
/// let prior = Gaussian::new(vec![0.0; 2], Matrix::from_rows(2, 2, vec![1.0, 0.8, 0.8, 1.0])?)?;
/// let a = Matrix::from_rows(1, 2, vec![1.0, 1.0])?;
/// let lmmse = Lmmse::new(Arc::new(prior), Noise::Absolute(1e-3))?;
/// let image = lmmse.recover(&Problem::new(a.view(), &[4.0])?, &mut Workspace::default())?;
/// assert!(image.coefficients.iter().all(|x| (x - 2.0).abs() < 1e-3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Lmmse {
    prior: Arc<Gaussian>,
    noise: Noise,
}

impl Lmmse {
    /// The estimate under `prior` for measurements with `noise`.
    ///
    /// # Errors
    /// [`ParameterError`] if `noise` is outside its range.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, ParameterError> {
        Ok(Self {
            prior,
            noise: noise.checked()?,
        })
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

/// x̂ → `x`.
fn estimate(model: &mut Model<'_, '_>) -> Result<(), RecoverError> {
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
    Ok(())
}

fn not_positive_definite(error: NotPositiveDefinite) -> RecoverError {
    RecoverError::NotPositiveDefinite { pivot: error.pivot }
}
