//! Most probable non-negative image under a Gaussian prior.

use super::gaussian::{GaussianScratch, Model};
use super::nnqp::{self, Hessian};
use super::parameter::{Noise, ParameterError};
use super::prior::Gaussian;
use super::scaling::power_of_two;
use crate::kernels::{adjoint, axpy, dot};
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;
use std::sync::Arc;

/// Most probable x ≥ 0 given y = A x + n, with x ~ N(μ, C) truncated to x ≥ 0, and n ~ N(0, σ² I):
///
/// min ‖y − A x‖² / (2σ²) + ½ (x − μ)ᵀ C⁻¹ (x − μ) subject to x ≥ 0.
///
/// Solved exactly by block principal pivoting on (Aᵀ A + σ² C⁻¹) x − (Aᵀ y + σ² C⁻¹ μ) ≥ 0 ⊥ x ≥ 0. Every solution is
/// checked for these conditions, to 1e-12 of the largest term. If no entry would be negative, the solution is that of
/// [`super::Lmmse`]. Noise variances below 1e-12 ‖A‖² tr(C) / (M N) are raised to that value.
/// Source: C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), ch. 23, for the problem. The prior adds
/// further rows to it.
///
/// ```
/// use spts_recon::recover::{Gaussian, NnLmmse, Noise};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
/// use std::sync::Arc;
///
/// let a = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0])?;
/// let estimate = NnLmmse::new(Arc::new(Gaussian::white(2, 10.0)?), Noise::Absolute(0.1))?;
/// let solution = estimate.recover(&Problem::new(a.view(), &[3.0, -0.2])?, &mut Workspace::default())?;
/// let mut image = [0.0; 2];
/// solution.scatter(&mut image);
/// assert!((image[0] - 3.0).abs() < 0.01 && image[1] == 0.0, "pressure is never negative");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct NnLmmse {
    prior: Arc<Gaussian>,
    noise: Noise,
}

/// Share of the largest entry below which an entry of the first guess counts as zero.
const HARDLY: f64 = 0.05;

impl NnLmmse {
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

/// μ + t d → `x`: the first step of steepest descent in the metric of the prior, d = C Aᵀ (y − A μ) with the best t. It
/// is nearly right about which entries are above zero; those that are hardly so are set to zero.
fn guess(model: &mut Model<'_, '_>) {
    model.project();
    let (n, prior, work) = (model.n, model.prior, &mut *model.work);
    let (slope, direction) = (&work.weights, &mut work.direction);
    direction.resize(n, 0.0);
    // C is symmetric
    adjoint(prior.covariance().view().values(), slope, direction);
    let (mut along, mut square) = (0.0, model.variance * dot(slope, direction));
    for (e, row) in work.innovation.iter().zip(work.operator.chunks_exact(n)) {
        let image = dot(row, direction);
        along += e * image;
        square += image * image;
    }
    work.x.clear();
    work.x.extend_from_slice(prior.mean());
    axpy(along / square, direction, &mut work.x);
    let least = HARDLY * work.x.iter().fold(0.0_f64, |most, v| most.max(*v));
    work.x.iter_mut().filter(|v| **v < least).for_each(|v| *v = 0.0);
}

impl Recover for NnLmmse {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let mut model = Model::new(problem, &self.prior, self.noise, workspace.scratch::<GaussianScratch>())?;
        guess(&mut model);
        let (variance, work) = (model.variance, &mut *model.work);
        // h = Aᵀ y + σ² C⁻¹ μ
        work.weights.resize(model.n, 0.0);
        adjoint(&work.operator, &work.y, &mut work.weights);
        axpy(variance, self.prior.natural(), &mut work.weights);
        // the answer scales with h, and squares and tolerances want numbers near 1
        let scale = power_of_two(&work.weights);
        if !scale.is_finite() {
            let atom = work.weights.iter().position(|h| !h.is_finite()).unwrap_or_default();
            return Err(RecoverError::Overflow { atom });
        }
        work.weights.iter_mut().for_each(|h| *h /= scale);
        let hessian = Hessian {
            rows: &work.operator,
            variance,
            precision: self.prior.precision().view().values(),
        };
        nnqp::minimise(&hessian, &work.weights, &mut work.x, &mut work.pivoting)?;
        work.x.iter_mut().for_each(|x| *x *= scale);
        let residual_norm = model.residual_norm();
        solution.set_dense(&model.work.x, 1.0, residual_norm)
    }
}
