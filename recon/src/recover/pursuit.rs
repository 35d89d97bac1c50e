//! Orthogonal matching pursuit, and its non-negative form.

use crate::kernels;
use crate::kernels::LANES;
use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover, Scaled, Scaling, Solution, Workspace};
use spts_input::Refusal;

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
    ) -> Result<(), Refusal> {
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
            state.previous.retain(|_| atoms.next().is_some_and(|atom| kept.contains(atom)));
        }
    }
}

impl Recover for NnOmp {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
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

/// Scratch memory of the greedy pursuits.
#[derive(Debug, Default)]
pub(crate) struct Greedy {
    pub(crate) scaling: Scaling,
    pub(crate) state: State,
}

impl Greedy {
    /// The problem scaled, the memory beside it, and the columns that a pursuit may use at most.
    ///
    /// # Errors
    /// [`Refusal`].
    pub(crate) fn begin<'a>(
        &'a mut self,
        problem: &Problem<'a>,
        n_nonzero_coefs: usize,
    ) -> Result<(Scaled<'a>, &'a mut State, usize), Refusal> {
        let problem = self.scaling.apply(problem)?;
        let limit = n_nonzero_coefs.min(problem.a.nrows()).min(problem.a.ncols());
        Ok((problem, &mut self.state, limit))
    }
}

/// Scratch memory beside the scaled problem.
#[derive(Debug, Default)]
pub(crate) struct State {
    pub(crate) factor: Factor,
    /// Weight of every column in the selection; 0 for columns that must not be selected.
    pub(crate) weights: Vec<f64>,
    /// Aᵀ r.
    pub(crate) correlation: Vec<f64>,
    pub(crate) alpha: Vec<f64>,
    pub(crate) previous: Vec<f64>,
    pub(crate) atoms: Vec<usize>,
}

impl State {
    /// `correlation = Aᵀ r` with the residual of the factorisation.
    pub(crate) fn correlate(&mut self, problem: &Scaled<'_>) {
        self.correlation.resize(problem.a.ncols(), 0.0);
        let residual = self.factor.residual(problem.a.nrows());
        kernels::adjoint(problem.a.values(), residual, &mut self.correlation);
    }

    /// True when the residual is nothing but rounding.
    pub(crate) fn converged(&self, problem: &Scaled<'_>) -> bool {
        self.factor.residual_norm() <= CONVERGED * problem.y_norm
    }

    /// True when the correlation of `atom` with the residual is nothing but rounding.
    pub(crate) fn uncorrelated(&self, problem: &Scaled<'_>, atom: usize) -> bool {
        self.correlation[atom].abs() <= CONVERGED * problem.y_norm * problem.squares[atom].sqrt()
    }

    /// Writes the least-squares solution on the columns of the factorisation.
    ///
    /// # Errors
    /// [`Refusal`].
    pub(crate) fn finish(&self, problem: &Scaled<'_>, solution: &mut Solution) -> Result<(), Refusal> {
        solution.support.clear();
        solution.support.extend_from_slice(self.factor.atoms());
        self.factor.coefficients_into(&mut solution.coefficients);
        solution.residual_norm = self.factor.residual_norm();
        problem.unscale(solution)
    }
}

/// A column whose part outside the span of the others is below this share of its length adds nothing but rounding.
pub(crate) const DEPENDENT: f64 = 1e-10;

/// The residual counts as zero below this share of ‖y‖: a pursuit cannot resolve less in double precision.
pub(crate) const CONVERGED: f64 = 1e-13;

/// A_S = Q R by Gram–Schmidt, the projections Qᵀ y and the residual y − Q Qᵀ y.
#[derive(Debug, Default)]
pub(crate) struct Factor {
    /// Rows M, rounded up to whole lanes; the padding is zero.
    stride: usize,
    basis: Vec<f64>,
    /// Columns of R, one after the other; column n has n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
    residual: Vec<f64>,
    atoms: Vec<usize>,
}

impl Factor {
    /// No column, and `y` as the residual. Room is kept for `limit` columns.
    pub(crate) fn start(&mut self, y: &[f64], limit: usize) {
        self.stride = y.len().next_multiple_of(LANES);
        self.residual.clear();
        self.residual.extend_from_slice(y);
        self.residual.resize(self.stride, 0.0);
        for buffer in [&mut self.basis, &mut self.upper, &mut self.projections] {
            buffer.clear();
        }
        self.atoms.clear();
        self.basis.reserve(limit * self.stride);
        self.upper.reserve(limit * (limit + 1) / 2);
        self.projections.reserve(limit);
        self.atoms.reserve(limit);
    }

    /// No column but `atoms`, those that depend on earlier ones left out.
    pub(crate) fn restart(&mut self, problem: &Scaled<'_>, atoms: &[usize]) {
        self.start(problem.y, atoms.len());
        for &atom in atoms {
            self.push(problem.a, atom);
        }
    }

    /// Appends column `atom` of `a` and takes its direction out of the residual. False, and nothing is changed, when it
    /// lies in the span of the others.
    pub(crate) fn push(&mut self, a: MatrixView<'_>, atom: usize) -> bool {
        let (m, n) = (a.nrows(), self.atoms.len());
        let (basis_len, upper_len) = (n * self.stride, self.upper.len());
        self.basis.resize(basis_len + self.stride, 0.0);
        self.upper.resize(upper_len + n + 1, 0.0);
        let (done, q) = self.basis.split_at_mut(basis_len);
        a.copy_column(atom, &mut q[..m]);
        let square = kernels::dot(q, q);
        let rest = kernels::orthogonalise(done, q, &mut self.upper[upper_len..upper_len + n]);
        if rest.is_nan() || rest <= DEPENDENT * DEPENDENT * square {
            self.basis.truncate(basis_len);
            self.upper.truncate(upper_len);
            return false;
        }
        let length = rest.sqrt();
        self.upper[upper_len + n] = length;
        let inverse = 1.0 / length;
        q.iter_mut().for_each(|v| *v *= inverse);
        let projection = kernels::dot(q, &self.residual);
        kernels::axpy(-projection, q, &mut self.residual);
        self.projections.push(projection);
        self.atoms.push(atom);
        true
    }

    /// Columns, in the order they came.
    pub(crate) fn atoms(&self) -> &[usize] {
        &self.atoms
    }

    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        self.atoms.len()
    }

    /// y − A_S α, length M.
    pub(crate) fn residual(&self, m: usize) -> &[f64] {
        &self.residual[..m]
    }

    /// ‖y − A_S α‖₂.
    pub(crate) fn residual_norm(&self) -> f64 {
        kernels::dot(&self.residual, &self.residual).sqrt()
    }

    /// Least-squares coefficients; overwrites `alpha`.
    pub(crate) fn coefficients_into(&self, alpha: &mut Vec<f64>) {
        back_substitute(&self.upper, &self.projections, alpha);
    }
}

/// Solves R α = `projections`; `upper` holds the columns of R one after the other, column n with n + 1 entries.
/// Overwrites `alpha`.
pub(crate) fn back_substitute(upper: &[f64], projections: &[f64], alpha: &mut Vec<f64>) {
    alpha.clear();
    alpha.extend_from_slice(projections);
    for n in (0..alpha.len()).rev() {
        let column = &upper[n * (n + 1) / 2..][..=n];
        let (known, rest) = alpha.split_at_mut(n);
        rest[0] /= column[n];
        for (a, r) in known.iter_mut().zip(column) {
            *a -= rest[0] * r;
        }
    }
}
