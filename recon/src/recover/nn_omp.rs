//! Non-negative orthogonal matching pursuit.

use super::greedy::{Greedy, State};
use super::scaling::Scaled;
use crate::kernels;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Non-negative orthogonal matching pursuit. Each step selects argmaxₖ aₖᵀ r / ‖aₖ‖₂ among the positive values and
/// solves min ‖y − A_S α‖₂, α ≥ 0, on the selected atoms. Atoms whose coefficient becomes 0 leave the support.
///
/// The least-squares solver is that of Lawson and Hanson: as long as an unconstrained coefficient is not positive, the
/// solution moves from the last feasible point towards it until the first coefficient is 0, and that atom is dropped.
/// The pursuit ends at `n_nonzero_coefs` atoms, when no atom has a positive correlation, or when the residual is only
/// rounding.
/// Source: A. M. Bruckstein, M. Elad, M. Zibulevsky, "On the uniqueness of nonnegative sparse solutions to
/// underdetermined systems of equations", IEEE Trans. Inf. Theory 54 (2008); T. T. Nguyen, J. Idier, C. Soussen, E.-H.
/// Djermoune, "Non-negative orthogonal greedy algorithms", IEEE Trans. Signal Process. 67 (2019); C. L. Lawson, R. J.
/// Hanson, *Solving Least Squares Problems* (1974), ch. 23.
///
/// ```
/// use spts_recon::recover::{NnOmp, Omp};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// let a = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0])?;
/// let y = [1.0, -3.0];
/// let (problem, mut work) = (Problem::new(a.view(), &y)?, Workspace::default());
/// assert_eq!(Omp::new(1).recover(&problem, &mut work)?.support, [1]);
/// assert_eq!(NnOmp::new(1).recover(&problem, &mut work)?.support, [0], "no negative coefficients");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NnOmp {
    n_nonzero_coefs: usize,
}

/// Steps a coefficient wanted: atoms come and go, and every step lowers the residual, so this many are never needed in
/// practice.
const STEPS: usize = 10;

impl NnOmp {
    /// A pursuit with at most `n_nonzero_coefs` atoms.
    #[must_use]
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

/// Goes from the feasible coefficients `previous` to the non-negative least squares on the atoms of the factorisation,
/// which keeps the positive ones; `previous` becomes the answer.
fn solve_non_negative(state: &mut State, problem: &Scaled<'_>) {
    loop {
        state.factor.coefficients_into(&mut state.alpha);
        // the share of the way to `alpha` at which the first coefficient becomes 0
        let (mut share, mut blocking) = (1.0, None);
        for (n, (&goal, &from)) in state.alpha.iter().zip(&state.previous).enumerate() {
            if goal <= 0.0 {
                // a new atom starts at 0 and may want to stay there
                let until = if from > 0.0 { from / (from - goal) } else { 0.0 };
                if blocking.is_none() || until < share {
                    (share, blocking) = (until, Some(n));
                }
            }
        }
        let Some(blocking) = blocking else {
            std::mem::swap(&mut state.previous, &mut state.alpha);
            return;
        };
        state.atoms.clear();
        let mut kept = 0;
        for n in 0..state.alpha.len() {
            let between = state.previous[n] + share * (state.alpha[n] - state.previous[n]);
            if n != blocking && (between > 0.0 || state.alpha[n] > 0.0) {
                state.atoms.push(state.factor.atoms()[n]);
                state.previous[kept] = between.max(0.0);
                kept += 1;
            }
        }
        state.previous.truncate(kept);
        state.factor.restart(problem, &state.atoms);
        if state.factor.len() < state.atoms.len() {
            // in another order an atom can turn out to depend on the others: its coefficient goes with it
            let mut atoms = state.atoms.iter();
            let kept = state.factor.atoms();
            state
                .previous
                .retain(|_| atoms.next().is_some_and(|atom| kept.contains(atom)));
        }
    }
}

impl Recover for NnOmp {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (problem, state, limit) = workspace.scratch::<Greedy>().begin(problem, self.n_nonzero_coefs)?;
        problem.weights_into(&mut state.weights);
        state.factor.start(problem.y, limit);
        state.previous.clear();
        for _ in 0..STEPS * limit {
            if state.factor.len() == limit || state.converged(&problem) {
                break;
            }
            state.correlate(&problem);
            // atoms of the support have no correlation left but rounding
            for &atom in state.factor.atoms() {
                state.correlation[atom] = 0.0;
            }
            let Some((atom, _)) = kernels::best_positive(&state.correlation, &state.weights) else {
                break;
            };
            if state.uncorrelated(&problem, atom) {
                break;
            }
            if !state.factor.push(problem.a, atom) {
                state.weights[atom] = 0.0;
                continue;
            }
            state.previous.push(0.0);
            solve_non_negative(state, &problem);
            if !state.factor.atoms().contains(&atom) {
                // its coefficient was positive but for rounding
                state.weights[atom] = 0.0;
            }
        }
        state.finish(&problem, solution)
    }
}
