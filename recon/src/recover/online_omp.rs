//! Orthogonal matching pursuit that does most of its work before the last measurement arrives.

use super::gram_pursuit::{Choice, GramPursuit};
use super::greedy::Greedy;
use super::omp::Omp;
use super::scaling::ORDINARY;
use crate::kernels;
use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover as _, RecoverError, Solution};
use crate::workspace::Workspace;

/// Orthogonal matching pursuit for a window whose measurements arrive one by one.
///
/// The rows of A are known before the measurements: [`Self::announce`] adds them to the Gram matrix G = Aᵀ A and the
/// column lengths, at O(K²) a row. [`Self::measure`] adds a measurement to Aᵀ y, at O(K). [`Self::recover_into`] then
/// runs a pursuit on G without using A: O(S²·K) for S atoms. It selects atoms like [`Omp`]; atoms are skipped if less
/// than 1e-10 of their square lies outside the span of the selected ones. If squares would overflow or vanish, [`Omp`]
/// itself is used.
///
/// ```
/// use spts_recon::recover::OnlineOmp;
/// use spts_recon::{Matrix, Solution, Workspace};
///
/// // two measurements of three unknowns; y = A·(0, 3, 0)
/// let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8])?;
/// let mut window = OnlineOmp::new(3, 1);
/// // the rows are known before the samples
/// window.announce(a.view())?;
/// for y in [0.0, 3.0] {
///     window.measure(y)?;
/// }
/// let mut solution = Solution::default();
/// window.recover_into(&mut Workspace::default(), &mut solution)?;
/// assert_eq!(solution.support, [1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct OnlineOmp {
    n_nonzero_coefs: usize,
    ncols: usize,
    /// Announced rows, one after the other.
    rows: Vec<f64>,
    gram: Vec<f64>,
    /// 1/‖aₖ‖, or 0 for zero columns.
    weights: Vec<f64>,
    y: Vec<f64>,
    /// Aᵀ y over the measurements so far.
    correlation: Vec<f64>,
    column: Vec<f64>,
}

impl OnlineOmp {
    /// An empty window of rows with `ncols` entries, for pursuits with at most `n_nonzero_coefs` atoms.
    #[must_use]
    pub fn new(ncols: usize, n_nonzero_coefs: usize) -> Self {
        Self {
            n_nonzero_coefs,
            ncols,
            rows: Vec::new(),
            gram: vec![0.0; ncols * ncols],
            weights: vec![0.0; ncols],
            y: Vec::new(),
            correlation: vec![0.0; ncols],
            column: Vec::new(),
        }
    }

    /// Removes rows and measurements.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.gram.fill(0.0);
        self.weights.fill(0.0);
        self.clear_measurements();
    }

    /// Removes the measurements; the rows stay.
    pub fn clear_measurements(&mut self) {
        self.y.clear();
        self.correlation.fill(0.0);
    }

    /// Adds rows of A for future measurements, in the order of measurement.
    ///
    /// # Errors
    /// [`RecoverError::Columns`] if the length of a row differs from `ncols`, [`RecoverError::OperatorNotFinite`].
    pub fn announce(&mut self, rows: MatrixView<'_>) -> Result<(), RecoverError> {
        let (k, values) = (self.ncols, rows.values());
        if rows.ncols() != k {
            return Err(RecoverError::Columns {
                cols: rows.ncols(),
                expected: k,
            });
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(RecoverError::OperatorNotFinite {
                row: at / k,
                col: at % k,
                value: values[at],
            });
        }
        self.rows.extend_from_slice(values);
        self.column.resize(rows.nrows(), 0.0);
        for (c, gram) in self.gram.chunks_exact_mut(k.max(1)).enumerate() {
            rows.copy_column(c, &mut self.column);
            kernels::add_adjoint(values, &self.column, gram);
            let length = gram[c].sqrt();
            self.weights[c] = if length > 0.0 { 1.0 / length } else { 0.0 };
        }
        Ok(())
    }

    /// Adds the next measurement. It belongs to the first announced row without one.
    ///
    /// # Errors
    /// [`RecoverError::NotFinite`], or [`RecoverError::ShapeMismatch`] if no row was announced for it. Nothing changes
    /// then.
    pub fn measure(&mut self, y: f64) -> Result<(), RecoverError> {
        let (index, k) = (self.y.len(), self.ncols);
        if !y.is_finite() {
            return Err(RecoverError::NotFinite { index, value: y });
        }
        let row = self
            .rows
            .get(index * k..(index + 1) * k)
            .ok_or(RecoverError::ShapeMismatch {
                rows: index,
                len: index + 1,
            })?;
        kernels::axpy(y, row, &mut self.correlation);
        self.y.push(y);
        Ok(())
    }

    /// Solves A α ≈ y for all announced rows into `solution`. After an error the content of `solution` has no meaning.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`] unless every announced row has a measurement, [`RecoverError::Empty`] without
    /// rows or atoms, [`RecoverError::Overflow`] if a coefficient exceeds the range of numbers.
    pub fn recover_into(&self, workspace: &mut Workspace, solution: &mut Solution) -> Result<(), RecoverError> {
        let (k, m) = (self.ncols, self.rows.len() / self.ncols.max(1));
        let shape = |_| RecoverError::Empty { rows: m, cols: k };
        let problem = Problem::new(MatrixView::new(m, k, &self.rows).map_err(shape)?, &self.y)?;
        let squares: f64 = (0..k).map(|c| self.gram[c * k + c]).sum();
        let y_square = kernels::dot(&self.y, &self.y);
        if !(ORDINARY.contains(&squares) && ORDINARY.contains(&y_square)) {
            return Omp::new(self.n_nonzero_coefs).recover_into(&problem, workspace, solution);
        }
        let scratch = &mut workspace.scratch::<Greedy>().gram;
        scratch.correlation.clear();
        scratch.correlation.extend_from_slice(&self.correlation);
        let pursuit = GramPursuit {
            gram: &self.gram,
            weights: &self.weights,
            choice: Choice::Correlation,
            limit: self.n_nonzero_coefs.min(m).min(k),
        };
        pursuit.run(y_square, scratch, solution);
        scratch.residual.clear();
        for (y, row) in self.y.iter().zip(self.rows.chunks_exact(k)) {
            let chosen = solution.support.iter().zip(&solution.coefficients);
            scratch.residual.push(y - chosen.map(|(&c, a)| row[c] * a).sum::<f64>());
        }
        solution.residual_norm = kernels::dot(&scratch.residual, &scratch.residual).sqrt();
        Ok(())
    }
}
