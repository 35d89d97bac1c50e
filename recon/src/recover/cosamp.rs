//! Compressive sampling matching pursuit.

use super::greedy::{Greedy, State, largest};
use super::scaling::Scaled;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Compressive sampling matching pursuit with S = `n_nonzero_coefs`. Each iteration adds the 2 S atoms with the largest
/// correlation with the residual to the support, solves the least-squares problem on all of them, and keeps the S
/// largest coefficients.
///
/// Columns are compared as if they had length 1. At most M atoms enter a least-squares problem, those of the old
/// support first. The final coefficients are the least-squares solution on the S atoms kept. It ends when the residual
/// is only rounding, when an iteration no longer reduces it (the better support is kept), or after 50 iterations.
/// Source: D. Needell, J. A. Tropp, "CoSaMP: Iterative signal recovery from incomplete and inaccurate samples", Appl.
/// Comput. Harmon. Anal. 26 (2009).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cosamp {
    n_nonzero_coefs: usize,
}

/// Most iterations.
const MAX_ITER: usize = 50;

impl Cosamp {
    /// A pursuit of `n_nonzero_coefs` atoms.
    #[must_use]
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

/// One iteration: leaves the factorisation of the new support.
fn iterate(state: &mut State, problem: &Scaled<'_>, sparsity: usize) {
    state.correlate(problem);
    state.dense.clear();
    let scores = state.correlation.iter().zip(&state.weights);
    state.dense.extend(scores.map(|(c, w)| c.abs() * w));
    largest(&state.dense, 2 * sparsity, &mut state.order);
    for &atom in &state.order {
        if state.factor.len() < problem.a.nrows() && !state.factor.atoms().contains(&atom) {
            state.factor.push(problem.a, atom);
        }
    }
    state.factor.coefficients_into(&mut state.alpha);
    state.dense.clear();
    let atoms = state.factor.atoms();
    let lengths = state.alpha.iter().zip(atoms);
    state
        .dense
        .extend(lengths.map(|(c, &k)| c.abs() * problem.squares[k].sqrt()));
    largest(&state.dense, sparsity, &mut state.order);
    state.atoms.clear();
    state.atoms.extend(state.order.iter().map(|&n| atoms[n]));
    state.factor.restart(problem, &state.atoms);
}

impl Recover for Cosamp {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (problem, state, sparsity) = workspace.scratch::<Greedy>().begin(problem, self.n_nonzero_coefs)?;
        problem.weights_into(&mut state.weights);
        state.factor.start(problem.y, (3 * sparsity).min(problem.a.nrows()));
        for _ in 0..MAX_ITER {
            if sparsity == 0 || state.converged(&problem) {
                break;
            }
            let before = state.factor.residual_norm();
            state.kept.clear();
            state.kept.extend_from_slice(state.factor.atoms());
            iterate(state, &problem, sparsity);
            if state.factor.residual_norm() >= before {
                state.factor.restart(&problem, &state.kept);
                break;
            }
        }
        state.finish(&problem, solution)
    }
}
