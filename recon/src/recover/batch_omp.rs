//! Orthogonal matching pursuit for many measurements with one operator.

use crate::kernels;
use crate::matrix::{Matrix, MatrixView};
use crate::problem::Workspace;
use crate::problem::unscale;
use crate::problem::{Problem, Solution};
use crate::recover::pursuit::Greedy;
use crate::recover::pursuit::{CONVERGED, back_substitute};
use spts_input::Refusal;

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
    /// [`Refusal`] for a matrix without rows or columns, [`Refusal`].
    pub fn new(matrix: MatrixView<'_>, n_nonzero_coefs: usize) -> Result<Self, Refusal> {
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
            a,
            columns,
            gram,
            weights,
            scale: scaled.matrix_scale(),
        })
    }

    /// Solves A α ≈ `y` into `solution`. After an error the content of `solution` has no meaning.
    ///
    /// # Errors
    /// [`Refusal`], [`Refusal`], and [`Refusal`] if a coefficient
    /// exceeds the range of numbers.
    pub fn recover_into(&self, y: &[f64], workspace: &mut Workspace, solution: &mut Solution) -> Result<(), Refusal> {
        let problem = Problem::new(self.a.view(), y)?;
        let greedy = workspace.scratch::<Greedy>();
        let (y, y_scale) = greedy.scaling.measurements(problem.y())?;
        let (k, scratch) = (self.a.ncols(), &mut greedy.gram);
        scratch.correlation.resize(k, 0.0);
        kernels::adjoint(self.a.view().values(), y, &mut scratch.correlation);
        let pursuit = GramPursuit {
            gram: self.gram.view().values(),
            weights: &self.weights,
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

/// Smallest share of an atom's square outside the span of the chosen ones.
const DEPENDENT_SQUARE: f64 = 1e-10;

/// Share of ‖y‖² below which the recurrence ‖r‖² ← ‖r‖² − p² holds rounding only.
const CONVERGED_SQUARE: f64 = 1e-14;

/// Scratch memory of a [`GramPursuit`].
#[derive(Debug, Default)]
pub(crate) struct GramScratch {
    weights: Vec<f64>,
    /// Aᵀ r: before the pursuit Aᵀ y.
    correlation: Vec<f64>,
    /// vᵢ, one after the other.
    images: Vec<f64>,
    /// Columns of R, one after the other; column n has n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
    residual: Vec<f64>,
}

/// Pursuit that looks at G = Aᵀ A instead of A.
///
/// With the directions qᵢ of the chosen atoms, vᵢ = Aᵀ qᵢ follows from the row g of G that belongs to the new atom k,
/// vₙ = (g − Σᵢ vᵢₖ vᵢ) / d with d² = ‖aₖ‖² − Σᵢ vᵢₖ², and the correlations from vₙ: a step costs O(n·K). (The source
/// updates the correlations from the coefficients instead, Aᵀ r = Aᵀ y − G_S α, to the same effect.) d² is a
/// difference, exact to a few 1e-16 of ‖a‖²: atoms with less than 1e-10 of their square outside the span of the chosen
/// ones are passed over, and a pursuit ends when ‖r‖² is below 1e-14 of ‖y‖². [`Omp`](super::Omp) resolves more.
/// Source: R. Rubinstein, M. Zibulevsky, M. Elad, "Efficient implementation of the K-SVD algorithm using batch
/// orthogonal matching pursuit", Technion CS-2008-08 (2008).
#[derive(Debug, Clone, Copy)]
struct GramPursuit<'a> {
    /// G, K × K.
    gram: &'a [f64],
    /// Weight of every atom in the selection, length K.
    weights: &'a [f64],
    /// Largest number of atoms.
    limit: usize,
}

impl GramPursuit<'_> {
    /// Chooses the atoms and writes their coefficients. `scratch.correlation` holds Aᵀ y, `y_square` is ‖y‖².
    fn run(&self, y_square: f64, scratch: &mut GramScratch, solution: &mut Solution) {
        let support = &mut solution.support;
        let mut residual_square = y_square;
        scratch.weights.clear();
        scratch.weights.extend_from_slice(self.weights);
        scratch.images.resize(self.limit * self.weights.len(), 0.0);
        scratch.upper.clear();
        scratch.projections.clear();
        support.clear();
        while support.len() < self.limit && residual_square > CONVERGED_SQUARE * y_square {
            let Some((atom, score)) = kernels::best_magnitude(&scratch.correlation, &scratch.weights) else {
                break;
            };
            if score <= CONVERGED * y_square.sqrt() {
                break;
            }
            // chosen, or in the span of the chosen ones: not again
            scratch.weights[atom] = 0.0;
            if let Some(projection) = self.push(atom, scratch, support.len()) {
                residual_square -= projection * projection;
                support.push(atom);
            }
        }
        back_substitute(&scratch.upper, &scratch.projections, &mut solution.coefficients);
    }

    /// Appends `atom` as column `n` and returns the projection of `y` on its direction; the correlations follow when
    /// there are steps to come. `None`, and nothing is changed, when it lies in the span of the others.
    fn push(&self, atom: usize, scratch: &mut GramScratch, n: usize) -> Option<f64> {
        let (k, start) = (self.weights.len(), scratch.upper.len());
        let g = &self.gram[atom * k..(atom + 1) * k];
        let (done, rest) = scratch.images.split_at_mut(n * k);
        scratch.upper.extend(done.chunks_exact(k).map(|v| v[atom]));
        let overlaps = &scratch.upper[start..];
        let square = g[atom] - overlaps.iter().map(|r| r * r).sum::<f64>();
        // not `<=`: a NaN must be passed over as well
        if square.partial_cmp(&(DEPENDENT_SQUARE * g[atom])) != Some(std::cmp::Ordering::Greater) {
            scratch.upper.truncate(start);
            return None;
        }
        let length = square.sqrt();
        let projection = scratch.correlation[atom] / length;
        if n + 1 < self.limit {
            let v = &mut rest[..k];
            kernels::gram_step(g, done, overlaps, length, projection, v, &mut scratch.correlation);
        }
        scratch.upper.push(length);
        scratch.projections.push(projection);
        Some(projection)
    }
}
