//! Orthogonal matching pursuit as in the published decoder.

use crate::checks::overflow;
use crate::kernels::{axpy, norm};
use crate::matrix::MatrixView;
use crate::operator::LinearOperator as _;
use crate::problem::Workspace;
use crate::problem::{Problem, Recover, Solution};
use crate::recover::pursuit::{CONVERGED, DEPENDENT};
use spts_input::Refusal;

/// Orthogonal matching pursuit with the behaviour of the published code: atoms are NOT normalised, the coefficients are
/// the least-squares solution on the selected atoms, and the pursuit ends at `n_nonzero_coefs` atoms or as soon as
/// another atom does not reduce the residual (that atom is then dropped).
///
/// Each step selects argmaxₖ |aₖᵀ r| and solves min ‖y − A_S α‖₂. The published code calls a pseudo-inverse. Here a
/// Gram–Schmidt QR of A_S grows by one column in each step. It gives the same minimiser as long as A_S has full column
/// rank; otherwise the residual rule ends the pursuit.
/// Source: Y. C. Pati, R. Rezaiifar, P. S. Krishnaprasad, "Orthogonal matching pursuit", Asilomar 1993.
///
/// ```
/// use spts_recon::recover::{Omp, ReferenceOmp};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// // the second atom is right, but the first is longer
/// let a = Matrix::from_rows(2, 2, vec![10.0, 0.0, 10.0, 1.0])?;
/// let (y, mut work) = ([0.0, 1.0], Workspace::default());
/// let problem = Problem::new(a.view(), &y)?;
/// assert_eq!(Omp::new(1).recover(&problem, &mut work)?.support, [1]);
/// assert_eq!(ReferenceOmp::new(1).recover(&problem, &mut work)?.support, [0], "atoms are not normalised");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReferenceOmp {
    n_nonzero_coefs: usize,
}

impl ReferenceOmp {
    /// A pursuit with at most `n_nonzero_coefs` atoms.
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

impl Recover for ReferenceOmp {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
        let (a, y) = (problem.matrix(), problem.y());
        let limit = self.n_nonzero_coefs.min(a.nrows()).min(a.ncols());
        let mut pursuit = Pursuit::start(a, y, limit, workspace.scratch());
        let y_norm = norm(y);
        let mut residual_norm = y_norm;
        let support = &mut solution.support;
        support.clear();
        while support.len() < limit && residual_norm > CONVERGED * y_norm {
            let atom = pursuit.best_atom();
            if support.contains(&atom) || !pursuit.extend(atom, support.len()) {
                break;
            }
            let candidate_norm = pursuit.residual_norm();
            // not `>=`: a NaN from an operator that overflows must end the pursuit as well
            if candidate_norm.partial_cmp(&residual_norm) != Some(std::cmp::Ordering::Less) {
                break;
            }
            residual_norm = candidate_norm;
            support.push(atom);
        }
        pursuit.coefficients(support.len(), &mut solution.coefficients);
        solution.residual_norm = residual_norm;
        let beyond = solution.coefficients.iter().position(|c| !c.is_finite());
        beyond.map_or(Ok(()), |n| Err(overflow(solution.support[n])))
    }
}

/// Growing QR factorisation A_S = Q R, its residual and its projections Qᵀ y.
struct Pursuit<'a, 'w> {
    a: MatrixView<'a>,
    limit: usize,
    work: &'w mut ReferenceScratch,
}

/// Scratch memory of the pursuit.
#[derive(Debug, Default)]
struct ReferenceScratch {
    residual: Vec<f64>,
    /// Aᵀ r.
    correlation: Vec<f64>,
    /// Columns of Q, one after the other.
    basis: Vec<f64>,
    /// R, row-major.
    upper: Vec<f64>,
    /// Qᵀ y.
    projection: Vec<f64>,
}

impl<'a, 'w> Pursuit<'a, 'w> {
    fn start(a: MatrixView<'a>, y: &[f64], limit: usize, work: &'w mut ReferenceScratch) -> Self {
        let m = a.nrows();
        work.residual.clear();
        work.residual.extend_from_slice(y);
        work.correlation.resize(a.ncols(), 0.0);
        work.basis.resize(limit * m, 0.0);
        work.upper.resize(limit * limit, 0.0);
        work.projection.resize(limit, 0.0);
        Self { a, limit, work }
    }

    /// argmaxₖ |aₖᵀ r|, the first of equals.
    fn best_atom(&mut self) -> usize {
        self.a.apply_adjoint(&self.work.residual, &mut self.work.correlation);
        let mut best = (0, 0.0);
        for (k, c) in self.work.correlation.iter().enumerate() {
            if c.abs() > best.1 {
                best = (k, c.abs());
            }
        }
        best.0
    }

    /// Appends `atom` as column `n` of the factorisation and takes its direction out of the residual. False when the
    /// atom lies in the span of the chosen ones.
    fn extend(&mut self, atom: usize, n: usize) -> bool {
        let m = self.a.nrows();
        let (done, rest) = self.work.basis.split_at_mut(n * m);
        let q = &mut rest[..m];
        self.a.copy_column(atom, q);
        let length = norm(q);
        for i in 0..n {
            self.work.upper[i * self.limit + n] = 0.0;
        }
        // twice is enough (Giraud et al. 2005): the second pass removes what rounding left of the first
        for _ in 0..2 {
            for (i, qi) in done.chunks_exact(m).enumerate() {
                let overlap = dot(qi, q);
                self.work.upper[i * self.limit + n] += overlap;
                axpy(-overlap, qi, q);
            }
        }
        let rest_length = norm(q);
        if rest_length.partial_cmp(&(DEPENDENT * length)) != Some(std::cmp::Ordering::Greater) {
            return false;
        }
        self.work.upper[n * self.limit + n] = rest_length;
        q.iter_mut().for_each(|v| *v /= rest_length);
        let projection = dot(q, &self.work.residual);
        self.work.projection[n] = projection;
        axpy(-projection, q, &mut self.work.residual);
        true
    }

    fn residual_norm(&self) -> f64 {
        norm(&self.work.residual)
    }

    /// Back substitution R α = Qᵀ y on the first `n` columns.
    fn coefficients(&self, n: usize, alpha: &mut Vec<f64>) {
        alpha.clear();
        alpha.extend_from_slice(&self.work.projection[..n]);
        for i in (0..n).rev() {
            let row = &self.work.upper[i * self.limit..][..n];
            let known: f64 = (i + 1..n).map(|j| row[j] * alpha[j]).sum();
            alpha[i] = (alpha[i] - known) / row[i];
        }
    }
}

/// One sum in the order of the entries: the published scores are compared to the last digit, so the arithmetic stays
/// the plain one.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Textbook pursuit with a pseudo-inverse, independent of the QR above.
    fn textbook(a: &DMatrix<f64>, y: &DVector<f64>, sparsity: usize) -> (Vec<usize>, DVector<f64>) {
        let (mut support, mut alpha, mut residual) = (Vec::new(), DVector::zeros(0), y.clone());
        while support.len() < sparsity {
            let atom = (a.transpose() * &residual).iamax();
            let mut trial: Vec<usize> = support.clone();
            trial.push(atom);
            let sub = a.select_columns(&trial);
            let solution = sub.clone().pseudo_inverse(1e-12).unwrap() * y;
            let next = y - sub * &solution;
            if next.norm() >= residual.norm() {
                break;
            }
            (support, alpha, residual) = (trial, solution, next);
        }
        (support, alpha)
    }

    #[test]
    fn equals_the_pseudo_inverse_algorithm() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for (m, k, s) in [(10, 40, 3), (25, 100, 6), (50, 100, 20), (100, 100, 25), (7, 5, 5)] {
            for _ in 0..20 {
                let a = DMatrix::from_fn(m, k, |_, _| rng.random_range(-1.0..1.0));
                let y = DVector::from_fn(m, |_, _| rng.random_range(-1.0..1.0));
                let dense = Matrix::from(&a);
                let problem = Problem::new(dense.view(), y.as_slice()).unwrap();
                let got = ReferenceOmp::new(s).recover(&problem, &mut Workspace::default()).unwrap();
                let (support, alpha) = textbook(&a, &y, s);
                assert_eq!(got.support, support, "{m} × {k}, S = {s}");
                for (g, e) in got.coefficients.iter().zip(alpha.iter()) {
                    // both solve a least-squares problem of condition below 1e4: 1e4·ε with a margin of 100
                    assert!((g - e).abs() <= 1e-10 * e.abs().max(1.0), "coefficient {g} against {e}");
                }
            }
        }
    }
}
