//! Orthogonal matching pursuit for many measurements with one operator.

use super::gram_pursuit::{Choice, GramPursuit};
use super::greedy::Greedy;
use super::scaling::unscale;
use crate::kernels;
use crate::matrix::{Matrix, MatrixView};
use crate::problem::{Problem, RecoverError, Solution};
use crate::workspace::Workspace;

/// Orthogonal matching pursuit with a precomputed Gram matrix G = Aᵀ A, for many `y` measured with the same A.
///
/// It selects atoms like [`Omp`](super::Omp). A step costs O(n·K) and does not use A. Atoms are skipped if less than
/// 1e-10 of their square lies outside the span of the selected ones, and a pursuit ends when ‖r‖² is below 1e-14 of
/// ‖y‖²; [`Omp`](super::Omp) has higher accuracy.
///
/// ```
/// use spts_recon::recover::BatchOmp;
/// use spts_recon::{Matrix, Solution, Workspace};
///
/// let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8])?;
/// let pursuit = BatchOmp::new(a.view(), 1)?;
/// let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
/// for (y, atom) in [([0.0, 3.0], 1), ([-2.0, 0.0], 0)] {
///     pursuit.recover_into(&y, &mut workspace, &mut solution)?;
///     assert_eq!(solution.support, [atom]);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
/// Source: R. Rubinstein, M. Zibulevsky, M. Elad, "Efficient implementation of the K-SVD algorithm using batch
/// orthogonal matching pursuit", Technion CS-2008-08 (2008).
#[derive(Debug, Clone)]
pub struct BatchOmp {
    n_nonzero_coefs: usize,
    choice: Choice,
    /// A, M × K, over `scale`.
    a: Matrix,
    /// Its columns, K × M.
    columns: Matrix,
    gram: Matrix,
    weights: Vec<f64>,
    /// A power of two.
    scale: f64,
}

impl BatchOmp {
    /// A pursuit with the operator `matrix` (M × K) and at most `n_nonzero_coefs` atoms. Columns are compared as if
    /// they had length 1. Costs O(M·K²).
    ///
    /// # Errors
    /// [`RecoverError::Empty`] for a matrix without rows or columns, [`RecoverError::OperatorNotFinite`].
    pub fn new(matrix: MatrixView<'_>, n_nonzero_coefs: usize) -> Result<Self, RecoverError> {
        let zero = vec![0.0; matrix.nrows()];
        let mut workspace = Workspace::default();
        let problem = Problem::new(matrix, &zero)?;
        let scaled = workspace.scratch::<Greedy>().scaling.apply(&problem)?;
        let mut weights = Vec::new();
        scaled.weights_into(&mut weights);
        let (m, k) = (matrix.nrows(), matrix.ncols());
        let mut a = Matrix::zeros(m, k);
        for r in 0..m {
            a.row_mut(r).copy_from_slice(&scaled.a.values()[r * k..(r + 1) * k]);
        }
        let (mut columns, mut gram) = (Matrix::zeros(k, m), Matrix::zeros(k, k));
        for c in 0..k {
            a.copy_column(c, columns.row_mut(c));
            kernels::adjoint(a.view().values(), columns.row(c), gram.row_mut(c));
        }
        Ok(Self {
            n_nonzero_coefs,
            choice: Choice::default(),
            a,
            columns,
            gram,
            weights,
            scale: scaled.matrix_scale(),
        })
    }

    /// The same pursuit with another selection rule.
    #[must_use]
    pub fn with_choice(self, choice: Choice) -> Self {
        Self { choice, ..self }
    }

    /// Solves A α ≈ `y` into `solution`. After an error the content of `solution` has no meaning.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`], [`RecoverError::NotFinite`], and [`RecoverError::Overflow`] if a coefficient
    /// exceeds the range of numbers.
    pub fn recover_into(
        &self,
        y: &[f64],
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let problem = Problem::new(self.a.view(), y)?;
        let greedy = workspace.scratch::<Greedy>();
        let (y, y_scale) = greedy.scaling.measurements(problem.y())?;
        let (k, scratch) = (self.a.ncols(), &mut greedy.gram);
        scratch.correlation.resize(k, 0.0);
        kernels::adjoint(self.a.view().values(), y, &mut scratch.correlation);
        let pursuit = GramPursuit {
            gram: self.gram.view().values(),
            weights: &self.weights,
            choice: self.choice,
            limit: self.n_nonzero_coefs.min(self.a.nrows()).min(k),
        };
        pursuit.run(kernels::dot(y, y), scratch, solution);
        scratch.residual.clear();
        scratch.residual.extend_from_slice(y);
        for (&atom, &coefficient) in solution.support.iter().zip(&solution.coefficients) {
            kernels::axpy(-coefficient, self.columns.row(atom), &mut scratch.residual);
        }
        solution.residual_norm = kernels::dot(&scratch.residual, &scratch.residual).sqrt();
        unscale(solution, y_scale, self.scale)
    }
}
