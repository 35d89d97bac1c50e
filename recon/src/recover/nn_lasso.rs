//! Non-negative lasso.

use super::descent::{Descent, NnLassoScratch};
use super::parameter::{ParameterError, Penalty, Stopping};
use super::scaling::{divide_into, operator_scale, power_of_two};
use crate::kernels::norm;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Non-negative lasso:
///
/// min ‖y − A w‖² / (2M) + α Σ wₖ subject to w ≥ 0, where α = `alpha` is the parameter of scikit-learn's
/// `Lasso(positive=True)`.
///
/// Coordinate descent on a working set, which the worst violators of the optimality conditions join. Between sweeps,
/// Newton steps on the non-zero entries, cut where one of them reaches zero, make the result exact. It stops when the
/// duality gap is at most `stopping.tol` · ‖y‖² / (2M). The feasible dual point is the residual, scaled down until no
/// column correlates with it by more than the penalty. Penalties below 1e-12 of the one that makes the solution zero
/// are raised to that value.
/// Source: J. Friedman, T. Hastie, R. Tibshirani, J. Stat. Softw. 33 (2010) 1, §2; gap and working set: M. Massias,
/// A. Gramfort, J. Salmon, "Celer", ICML 2018.
///
/// ```
/// use spts_recon::recover::{NnLasso, Penalty};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8])?;
/// let lasso = NnLasso::new(Penalty::Relative(0.01))?;
/// let solution = lasso.recover(&Problem::new(a.view(), &[0.6, 0.8])?, &mut Workspace::default())?;
/// assert_eq!(solution.support, [2], "one atom explains both measurements");
/// assert!((solution.coefficients[0] - 0.99).abs() < 1e-6, "shrunk by the penalty");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NnLasso {
    alpha: Penalty,
    normalise: bool,
    /// Largest duality gap relative to ‖y‖² / (2M), and largest number of sweeps; default [`Self::STOPPING`].
    pub stopping: Stopping,
}

impl NnLasso {
    /// Default of `stopping`.
    pub const STOPPING: Stopping = Stopping {
        tol: 1e-8,
        max_iter: 10_000,
    };

    /// A lasso with the penalty `alpha`.
    ///
    /// # Errors
    /// [`ParameterError`] if `alpha` is outside its range.
    pub fn new(alpha: Penalty) -> Result<Self, ParameterError> {
        Ok(Self {
            alpha: alpha.checked()?,
            normalise: false,
            stopping: Self::STOPPING,
        })
    }

    /// The same with columns scaled to unit length first. Coefficients belong to the columns as given.
    #[must_use]
    pub fn with_normalised_columns(self) -> Self {
        Self {
            normalise: true,
            ..self
        }
    }

    /// The problem near 1, and what its coefficients must be multiplied by.
    fn set_up<'w>(
        &self,
        problem: &Problem<'_>,
        workspace: &'w mut Workspace,
    ) -> Result<(Descent<'w>, f64), RecoverError> {
        let (a, y) = (problem.matrix(), problem.y());
        let (a_scale, y_scale) = (operator_scale(a)?, power_of_two(y));
        let m = a.nrows();
        let work = workspace.scratch::<NnLassoScratch>();
        a.copy_columns(&mut work.columns);
        work.columns.iter_mut().for_each(|v| *v /= a_scale);
        work.lengths.clear();
        work.lengths.extend(work.columns.chunks_exact(m).map(norm));
        if self.normalise {
            for (column, &length) in work.columns.chunks_exact_mut(m).zip(&work.lengths) {
                if length > 0.0 {
                    column.iter_mut().for_each(|v| *v /= length);
                }
            }
        } else {
            work.lengths.fill(1.0);
        }
        divide_into(y, y_scale, &mut work.y);
        let x_scale = y_scale / a_scale;
        let mut descent = Descent::new(m, work);
        descent.set_penalty(self.penalty(m, a_scale, x_scale, descent.largest()));
        Ok((descent, x_scale))
    }

    /// λ = M α in the units of the scaled problem.
    fn penalty(&self, m: usize, a_scale: f64, x_scale: f64, largest: f64) -> f64 {
        match self.alpha {
            Penalty::Absolute(alpha) => {
                // the objective was divided by a_scale² x_scale²; unit columns leave the scale of A to their
                // coefficients
                let (of_a, of_x) = if self.normalise {
                    (1.0, x_scale * a_scale)
                } else {
                    (a_scale, x_scale)
                };
                alpha * m as f64 / of_x / of_a / of_a
            }
            Penalty::Relative(share) => share * largest,
        }
    }
}

impl Recover for NnLasso {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (mut descent, x_scale) = self.set_up(problem, workspace)?;
        descent.run(self.stopping)?;
        descent.write(x_scale, power_of_two(problem.y()), solution)
    }
}
