//! Orthogonal matching pursuit.

use super::greedy::Greedy;
use crate::kernels;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Orthogonal matching pursuit: each step chooses argmaxₖ |aₖᵀ r| / ‖aₖ‖₂ and makes the residual r orthogonal to all
/// chosen atoms; the coefficients are the least-squares solution on them.
///
/// It ends at `n_nonzero_coefs` atoms, or earlier when the residual is nothing but rounding. The QR factorisation of
/// the chosen atoms grows by one column a step (Gram–Schmidt with a second pass where digits were lost), O(M·K) a step,
/// and nothing is allocated once the workspace has its size. An atom in the span of the chosen ones is passed over; so
/// is a column shorter than 1e-50 of the longest. Problems of any magnitude are scaled by powers of two first.
/// Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar 1993.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Omp {
    n_nonzero_coefs: usize,
}

impl Omp {
    /// Pursuit that stops at `n_nonzero_coefs` atoms at the latest.
    #[must_use]
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

impl Recover for Omp {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (problem, state, limit) = workspace.scratch::<Greedy>().begin(problem, self.n_nonzero_coefs)?;
        problem.weights_into(&mut state.weights);
        state.factor.start(problem.y, limit);
        while state.factor.len() < limit && !state.converged(&problem) {
            state.correlate(&problem);
            let Some((atom, _)) = kernels::best_magnitude(&state.correlation, &state.weights) else {
                break;
            };
            if state.uncorrelated(&problem, atom) {
                break;
            }
            state.factor.push(problem.a, atom);
            // chosen, or in the span of the chosen ones: not again
            state.weights[atom] = 0.0;
        }
        state.finish(&problem, solution)
    }
}
