//! Orthogonal matching pursuit of many measurements with one operator.

use super::factor::{CONVERGED, back_substitute};
use super::scaling::unscale;
use crate::kernels;
use crate::matrix::{Matrix, MatrixView};
use crate::problem::{Problem, RecoverError, Solution, Workspace};
use rayon::prelude::*;

/// Orthogonal matching pursuit with the Gram matrix G = Aᵀ A ready: for many `y` measured with the same A.
///
/// The choice is that of [`Omp`](super::Omp). With the directions qᵢ of the chosen atoms, vᵢ = Aᵀ qᵢ follows from the row g of G that
/// belongs to the new atom k, vₙ = (g − Σᵢ vᵢₖ vᵢ) / d with d² = ‖aₖ‖² − Σᵢ vᵢₖ², and the correlations from vₙ: a step costs O(n·K) and does
/// not look at A. (The source updates the correlations from the coefficients instead, Aᵀ r = Aᵀ y − G_S α, to the same effect.)
/// d² is a difference, exact to a few 1e-16 of ‖a‖²: atoms with less than 1e-10 of their square outside the span of the chosen ones
/// are passed over, and a pursuit ends when ‖r‖² is below 1e-14 of ‖y‖². [`Omp`](super::Omp) resolves more.
/// Source: R. Rubinstein, M. Zibulevsky, M. Elad, "Efficient implementation of the K-SVD algorithm using batch orthogonal matching
/// pursuit", Technion CS-2008-08 (2008).
#[derive(Debug, Clone)]
pub struct BatchOmp {
    n_nonzero_coefs: usize,
    /// A, M × K, over `scale`.
    a: Matrix,
    /// Its columns, K × M.
    columns: Matrix,
    gram: Matrix,
    weights: Vec<f64>,
    /// A power of two.
    scale: f64,
}

/// Smallest share of an atom's square outside the span of the chosen ones.
const DEPENDENT_SQUARE: f64 = 1e-10;

/// Share of ‖y‖² below which the recurrence ‖r‖² ← ‖r‖² − p² holds rounding only.
const CONVERGED_SQUARE: f64 = 1e-14;

/// Scratch memory of [`BatchOmp`].
#[derive(Debug, Default)]
pub(crate) struct GramScratch {
    weights: Vec<f64>,
    correlation: Vec<f64>,
    /// vᵢ, one after the other.
    images: Vec<f64>,
    /// Columns of R one after the other, column n with n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
    residual: Vec<f64>,
}

impl BatchOmp {
    /// Pursuit with the operator `matrix` (M × K), columns compared as if they had length 1, that stops at `n_nonzero_coefs` atoms at
    /// the latest. Costs O(M·K²).
    ///
    /// # Errors
    /// [`RecoverError::Empty`] for a matrix without rows or columns, [`RecoverError::OperatorNotFinite`].
    pub fn new(matrix: MatrixView<'_>, n_nonzero_coefs: usize) -> Result<Self, RecoverError> {
        let zero = vec![0.0; matrix.nrows()];
        let mut workspace = Workspace::default();
        let problem = Problem::new(matrix, &zero)?;
        let scaled = workspace.greedy.scaling.apply(&problem)?;
        let mut weights = Vec::new();
        scaled.weights_into(true, &mut weights);
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
            a,
            columns,
            gram,
            weights,
            scale: scaled.matrix_scale(),
        })
    }

    /// Solves A α ≈ `y` and overwrites `solution`. After an error its content is of no meaning.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`], [`RecoverError::NotFinite`]; [`RecoverError::Overflow`] when a coefficient is beyond the
    /// range of numbers.
    pub fn recover_into(
        &self,
        y: &[f64],
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let problem = Problem::new(self.a.view(), y)?;
        let greedy = &mut workspace.greedy;
        let (y, y_scale) = greedy.scaling.measurements(problem.y())?;
        self.pursue(y, &mut greedy.gram, &mut solution.support);
        self.finish(y, &mut greedy.gram, solution);
        unscale(solution, y_scale, self.scale)
    }

    /// Solves for every row of `ys` (number of problems × M), on all threads; the result does not depend on their number.
    ///
    /// # Errors
    /// That of the first row that has one.
    pub fn recover_all(&self, ys: &Matrix) -> Result<Vec<Solution>, RecoverError> {
        (0..ys.nrows())
            .into_par_iter()
            .map_init(Workspace::default, |workspace, r| {
                let mut solution = Solution::default();
                self.recover_into(ys.row(r), workspace, &mut solution)?;
                Ok(solution)
            })
            .collect()
    }

    /// Chooses the atoms.
    fn pursue(&self, y: &[f64], scratch: &mut GramScratch, support: &mut Vec<usize>) {
        let k = self.a.ncols();
        let limit = self.n_nonzero_coefs.min(self.a.nrows()).min(k);
        let y_square = kernels::dot(y, y);
        let mut residual_square = y_square;
        scratch.weights.clone_from(&self.weights);
        scratch.correlation.resize(k, 0.0);
        kernels::adjoint(self.a.view().values(), y, &mut scratch.correlation);
        scratch.images.resize(limit * k, 0.0);
        scratch.upper.clear();
        scratch.projections.clear();
        support.clear();
        while support.len() < limit && residual_square > CONVERGED_SQUARE * y_square {
            let Some((atom, score)) = kernels::best_magnitude(&scratch.correlation, &scratch.weights) else {
                break;
            };
            if score <= CONVERGED * y_square.sqrt() {
                break;
            }
            // chosen, or in the span of the chosen ones: not again
            scratch.weights[atom] = 0.0;
            if let Some(projection) = self.push(atom, scratch, support.len(), support.len() + 1 < limit) {
                residual_square -= projection * projection;
                support.push(atom);
            }
        }
    }

    /// Appends `atom` as column `n` and returns the projection of `y` on its direction; the correlations follow when there are
    /// `more` steps to come. `None`, and nothing is changed, when it lies in the span of the others.
    fn push(&self, atom: usize, scratch: &mut GramScratch, n: usize, more: bool) -> Option<f64> {
        let (k, start) = (self.a.ncols(), scratch.upper.len());
        let g = self.gram.row(atom);
        let (done, rest) = scratch.images.split_at_mut(n * k);
        scratch.upper.extend(done.chunks_exact(k).map(|v| v[atom]));
        let overlaps = &scratch.upper[start..];
        let square = g[atom] - overlaps.iter().map(|r| r * r).sum::<f64>();
        if square <= DEPENDENT_SQUARE * g[atom] {
            scratch.upper.truncate(start);
            return None;
        }
        let length = square.sqrt();
        let projection = scratch.correlation[atom] / length;
        if more {
            let v = &mut rest[..k];
            kernels::gram_step(g, done, overlaps, length, projection, v, &mut scratch.correlation);
        }
        scratch.upper.push(length);
        scratch.projections.push(projection);
        Some(projection)
    }

    /// Coefficients by back substitution, and the residual from them.
    fn finish(&self, y: &[f64], scratch: &mut GramScratch, solution: &mut Solution) {
        back_substitute(&scratch.upper, &scratch.projections, &mut solution.coefficients);
        scratch.residual.clear();
        scratch.residual.extend_from_slice(y);
        for (&atom, &coefficient) in solution.support.iter().zip(&solution.coefficients) {
            kernels::axpy(-coefficient, self.columns.row(atom), &mut scratch.residual);
        }
        solution.residual_norm = kernels::dot(&scratch.residual, &scratch.residual).sqrt();
    }
}
