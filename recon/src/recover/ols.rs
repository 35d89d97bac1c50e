//! Orthogonal least squares.

use super::greedy::{Greedy, State};
use super::scaling::Scaled;
use crate::kernels;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Orthogonal least squares (also called optimised or order-recursive matching pursuit). Each step selects the atom
/// that reduces the residual of the least-squares fit most, argmaxₖ (aₖᵀ r)² / ‖P aₖ‖², where P projects off the span
/// of the selected atoms.
///
/// The lengths are updated with the new direction q of every step, ‖P aₖ‖² ← ‖P aₖ‖² − (qᵀ aₖ)², so a step costs
/// O(M·K), as in orthogonal matching pursuit. Scaling a column does not change the selection. It ends at
/// `n_nonzero_coefs` atoms, or earlier when the residual is only rounding.
/// Source: S. Chen, S. A. Billings, W. Luo, "Orthogonal least squares methods and their application to non-linear
/// system identification", Int. J. Control 50 (1989); L. Rebollo-Neira, D. Lowe, "Optimized orthogonal matching pursuit
/// approach", IEEE Signal Process. Lett. 9 (2002).
///
/// ```
/// use spts_recon::recover::Ols;
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// let a = Matrix::from_rows(3, 3, vec![1.0, 0.0, 0.9, 0.0, 1.0, 0.9, 0.0, 0.0, 0.1])?;
/// let y = [2.0, 3.0, 0.0]; // twice the first atom and three times the second
/// let solution = Ols::new(3).recover(&Problem::new(a.view(), &y)?, &mut Workspace::default())?;
/// assert!(solution.residual_norm < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ols {
    n_nonzero_coefs: usize,
}

/// Atoms with less than this share of their square outside the span of the chosen ones are passed over: ‖P aₖ‖² is a
/// difference, exact to a few 1e-16 of ‖aₖ‖², so that its first three digits are right above this.
const DEPENDENT_SQUARE: f64 = 1e-12;

impl Ols {
    /// A pursuit with at most `n_nonzero_coefs` atoms.
    #[must_use]
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

/// `weights` = 1/‖P aₖ‖² from `outside` = ‖P aₖ‖², 0 for atoms that must not be chosen.
fn weigh(state: &mut State, problem: &Scaled<'_>) {
    state.weights.clear();
    let shares = state.dense.iter().zip(problem.squares);
    state.weights.extend(shares.map(|(&outside, &square)| {
        if outside > DEPENDENT_SQUARE * square {
            1.0 / outside
        } else {
            0.0
        }
    }));
}

/// Takes the last column of the factorisation out of the correlations and of the atoms' squares outside the span.
fn update(state: &mut State, problem: &Scaled<'_>) {
    let Some((direction, projection)) = state.factor.last(problem.a.nrows()) else {
        return;
    };
    state.image.resize(problem.a.ncols(), 0.0);
    kernels::adjoint(problem.a.values(), direction, &mut state.image);
    let squares = state.correlation.iter_mut().zip(&mut state.dense);
    for ((correlation, outside), share) in squares.zip(&state.image) {
        *correlation -= projection * share;
        *outside -= share * share;
    }
}

impl Recover for Ols {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (problem, state, limit) = workspace.scratch::<Greedy>().begin(problem, self.n_nonzero_coefs)?;
        state.factor.start(problem.y, limit);
        state.correlate(&problem);
        // `dense` holds ‖P aₖ‖²
        state.dense.clear();
        state.dense.extend_from_slice(problem.squares);
        while state.factor.len() < limit && !state.converged(&problem) {
            weigh(state, &problem);
            let Some((atom, _)) = kernels::best_square(&state.correlation, &state.weights) else {
                break;
            };
            if state.uncorrelated(&problem, atom) {
                break;
            }
            state.dense[atom] = f64::NEG_INFINITY;
            if state.factor.push(problem.a, atom) && state.factor.len() < limit {
                update(state, &problem);
            }
        }
        state.finish(&problem, solution)
    }
}
