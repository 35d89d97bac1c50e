//! The recovery problem, and the trait of its solvers.

use crate::matrix::MatrixView;
use crate::workspace::Workspace;

/// The problem: find a sparse `α` with `A α ≈ y`.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    matrix: MatrixView<'a>,
    y: &'a [f64],
}

impl<'a> Problem<'a> {
    /// A problem with the operator `matrix` (M × K) and the measurements `y` (length M).
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`] if the lengths differ, [`RecoverError::Empty`] if there is no measurement or no
    /// atom, [`RecoverError::NotFinite`] if `y` holds a NaN or an infinity.
    pub fn new(matrix: MatrixView<'a>, y: &'a [f64]) -> Result<Self, RecoverError> {
        if matrix.nrows() != y.len() {
            return Err(RecoverError::ShapeMismatch {
                rows: matrix.nrows(),
                len: y.len(),
            });
        }
        if y.is_empty() || matrix.ncols() == 0 {
            return Err(RecoverError::Empty {
                rows: matrix.nrows(),
                cols: matrix.ncols(),
            });
        }
        if let Some((index, &value)) = y.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(RecoverError::NotFinite { index, value });
        }
        Ok(Self { matrix, y })
    }

    /// Operator A, M × K.
    #[must_use]
    pub fn matrix(&self) -> MatrixView<'a> {
        self.matrix
    }

    /// Measurements, length M.
    #[must_use]
    pub fn y(&self) -> &'a [f64] {
        self.y
    }
}

/// A sparse solution.
///
/// ```
/// use spts_recon::{Matrix, Solution};
///
/// let solution = Solution { support: vec![2, 0], coefficients: vec![3.0, -1.0], residual_norm: 0.0 };
/// let mut x = [0.0; 4];
/// solution.scatter(&mut x);
/// assert_eq!(x, [-1.0, 0.0, 3.0, 0.0]);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solution {
    /// Indices of the selected atoms, in order of selection.
    pub support: Vec<usize>,
    /// Coefficient of each atom of `support`.
    pub coefficients: Vec<f64>,
    /// ‖y − A α‖₂.
    pub residual_norm: f64,
}

impl Solution {
    /// Makes this the entries of `x` that are not zero, in the order of their indices, times `scale`.
    ///
    /// # Errors
    /// [`RecoverError::Overflow`] when an entry is beyond the range of numbers.
    pub(crate) fn set_dense(&mut self, x: &[f64], scale: f64, residual_norm: f64) -> Result<(), RecoverError> {
        self.support.clear();
        self.coefficients.clear();
        self.residual_norm = residual_norm.min(f64::MAX);
        for (atom, &value) in x.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let coefficient = value * scale;
            if !coefficient.is_finite() {
                return Err(RecoverError::Overflow { atom });
            }
            self.support.push(atom);
            self.coefficients.push(coefficient);
        }
        Ok(())
    }

    /// Makes this the solution without atoms, which leaves all of `y`.
    pub(crate) fn set_zero(&mut self, residual_norm: f64) {
        self.support.clear();
        self.coefficients.clear();
        self.residual_norm = residual_norm;
    }

    /// Writes the coefficients to their positions in `x` (length K), and zeros everywhere else.
    pub fn scatter(&self, x: &mut [f64]) {
        x.fill(0.0);
        for (&k, &c) in self.support.iter().zip(&self.coefficients) {
            x[k] = c;
        }
    }

    /// Computes the image `D α` for a dictionary `D` (N × K, row-major) into `image` (length N).
    pub fn synthesise(&self, dictionary: MatrixView<'_>, image: &mut [f64]) {
        for (out, row) in image
            .iter_mut()
            .zip(dictionary.values().chunks_exact(dictionary.ncols().max(1)))
        {
            *out = self
                .support
                .iter()
                .zip(&self.coefficients)
                .map(|(&k, &c)| c * row[k])
                .sum();
        }
    }
}

/// Why a problem has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecoverError {
    /// The sizes of operator and measurements differ.
    #[error("operator has {rows} rows but `y` has {len} entries")]
    ShapeMismatch {
        /// Rows of the operator.
        rows: usize,
        /// Length of `y`.
        len: usize,
    },
    /// There is no measurement, or no atom.
    #[error("operator has shape {rows} × {cols}; both must be at least 1")]
    Empty {
        /// Rows of the operator.
        rows: usize,
        /// Columns of the operator.
        cols: usize,
    },
    /// An entry of the operator is NaN or infinite.
    #[error("operator[{row}, {col}] = {value} is not finite")]
    OperatorNotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        col: usize,
        /// The value.
        value: f64,
    },
    /// The method was built for another number of unknowns.
    #[error("operator has {cols} columns; the method was built for {expected}")]
    Columns {
        /// Columns of the operator.
        cols: usize,
        /// Number of unknowns of the prior or the grid.
        expected: usize,
    },
    /// The normal equations cannot be solved.
    #[error("the matrix of the normal equations is not positive definite at pivot {pivot}")]
    NotPositiveDefinite {
        /// First pivot that is not above zero.
        pivot: usize,
    },
    /// The iteration ended before it reached the tolerance.
    #[error("no convergence in {iterations} iterations (relative error {error:.3e}, tolerance {tol:.3e})")]
    NotConverged {
        /// Number of iterations.
        iterations: usize,
        /// Relative error reached, as the method defines it.
        error: f64,
        /// Required relative error.
        tol: f64,
    },
    /// A measurement is NaN or infinite.
    #[error("`y[{index}]` = {value} is not finite")]
    NotFinite {
        /// Index of the measurement.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A measurement minus the prior mean's prediction exceeds the range of numbers.
    #[error("`y[{index}]` minus the prior mean's prediction exceeds the range of 64-bit numbers")]
    InnovationOverflow {
        /// Index of the measurement.
        index: usize,
    },
    /// A coefficient exceeds the range of numbers, as with measurements of 1e300 and an operator of 1e-300.
    #[error("the coefficient of atom {atom} exceeds the range of 64-bit numbers")]
    Overflow {
        /// Column of the operator.
        atom: usize,
    },
}

/// A sparse-recovery algorithm.
///
/// ```
/// use spts_recon::{Matrix, Problem, Recover, RecoverError, Solution, Workspace};
///
/// /// The atom (of length 1) that correlates most with the measurements.
/// struct Single;
///
/// impl Recover for Single {
///     fn recover_into(&self, p: &Problem<'_>, _: &mut Workspace, best: &mut Solution) -> Result<(), RecoverError> {
///         *best = Solution::default();
///         let mut atom = vec![0.0; p.y().len()];
///         for k in 0..p.matrix().ncols() {
///             p.matrix().copy_column(k, &mut atom);
///             let c: f64 = atom.iter().zip(p.y()).map(|(a, y)| a * y).sum();
///             if best.coefficients.first().is_none_or(|b| c.abs() > b.abs()) {
///                 (best.support, best.coefficients) = (vec![k], vec![c]);
///             }
///         }
///         Ok(())
///     }
/// }
/// let a = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
/// let solution = Single.recover(&Problem::new(a.view(), &[0.2, 3.0])?, &mut Workspace::default())?;
/// assert_eq!(solution.support, [1]);
/// # Ok::<(), RecoverError>(())
/// ```
pub trait Recover: Send + Sync {
    /// Solves `problem` into `solution`, whose memory is reused. After an error the content of `solution` has no
    /// meaning.
    ///
    /// # Errors
    /// [`RecoverError`] if the problem cannot be solved. A valid [`Problem`] never causes a panic.
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError>;

    /// Solves `problem`.
    ///
    /// # Errors
    /// As [`Self::recover_into`].
    fn recover(&self, problem: &Problem<'_>, workspace: &mut Workspace) -> Result<Solution, RecoverError> {
        let mut solution = Solution::default();
        self.recover_into(problem, workspace, &mut solution)?;
        Ok(solution)
    }
}
