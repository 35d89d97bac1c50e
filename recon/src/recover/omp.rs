//! Orthogonal matching pursuit.

use super::greedy::Greedy;
use crate::kernels;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Orthogonal matching pursuit. Each step selects argmaxₖ |aₖᵀ r| / ‖aₖ‖₂ and makes the residual r orthogonal to all
/// selected atoms. The coefficients are the least-squares solution on them.
///
/// It ends at `n_nonzero_coefs` atoms, or earlier when the residual is only rounding. The QR factorisation of the
/// selected atoms grows by one column in each step (Gram–Schmidt, repeated where digits were lost), at O(M·K) a step;
/// nothing is allocated once the workspace has its size. Atoms in the span of the selected ones, and columns shorter
/// than 1e-50 of the longest, are skipped. Problems of any magnitude are first scaled by powers of two.
/// Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar 1993.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Omp {
    n_nonzero_coefs: usize,
}

impl Omp {
    /// A pursuit with at most `n_nonzero_coefs` atoms.
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
