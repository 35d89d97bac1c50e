//! Any method, one measurement after the other.

use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Solutions with M = 1, 2, 3, … measurements, each begun at the one before; the [module](super) says which methods
/// gain from that.
///
/// Memory grows to the longest run of measurements; after [`Self::clear`] a run no longer than that allocates nothing.
///
/// ```
/// use spts_recon::recover::{NnLasso, Penalty, Progressive};
///
/// // two unknowns, of which the second is 2; three measurements
/// let mut progressive = Progressive::new(NnLasso::new(Penalty::Relative(1e-6))?, 2);
/// for (row, y) in [([1.0, 1.0], 2.0), ([1.0, -1.0], -2.0), ([-1.0, 1.0], 2.0)] {
///     progressive.observe(&row, y)?;
/// }
/// let mut image = [0.0; 2];
/// progressive.solution().scatter(&mut image);
/// assert!(image[0].abs() < 1e-4 && (image[1] - 2.0).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
/// Source: the progressive images of the single-pixel tactile skin's paper, its Fig. 4.
#[derive(Debug)]
pub struct Progressive<R> {
    method: R,
    columns: usize,
    rows: Vec<f64>,
    y: Vec<f64>,
    solution: Solution,
    /// Memory of the solution being made; a failure must not touch the one before.
    next: Solution,
    workspace: Workspace,
}

impl<R: Recover> Progressive<R> {
    /// Solver by `method` for `columns` unknowns that has seen nothing: its solution is zero.
    #[must_use]
    pub fn new(method: R, columns: usize) -> Self {
        Self {
            method,
            columns,
            rows: Vec::new(),
            y: Vec::new(),
            solution: Solution::default(),
            next: Solution::default(),
            workspace: Workspace::default(),
        }
    }

    /// Takes one measurement `y` with its row of the operator and returns the solution with all measurements so far.
    ///
    /// # Errors
    /// [`RecoverError`] when `row` does not have as many values as there are unknowns, `y` is not finite, or the method
    /// fails. The measurement then does not count, and the solution is the one before.
    pub fn observe(&mut self, row: &[f64], y: f64) -> Result<&Solution, RecoverError> {
        if row.len() != self.columns {
            return Err(RecoverError::Columns {
                cols: row.len(),
                expected: self.columns,
            });
        }
        self.rows.extend_from_slice(row);
        self.y.push(y);
        if let Err(error) = self.solve() {
            self.y.pop();
            self.rows.truncate(self.y.len() * self.columns);
            return Err(error);
        }
        std::mem::swap(&mut self.solution, &mut self.next);
        Ok(&self.solution)
    }

    /// Solves with all rows into `next`.
    fn solve(&mut self) -> Result<(), RecoverError> {
        let shape = RecoverError::ShapeMismatch {
            rows: self.y.len(),
            len: self.rows.len(),
        };
        let operator = MatrixView::new(self.y.len(), self.columns, &self.rows).map_err(|_| shape)?;
        let problem = Problem::new(operator, &self.y)?;
        self.method
            .recover_from_into(&problem, &self.solution, &mut self.workspace, &mut self.next)
    }

    /// Solution with all measurements so far.
    #[must_use]
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Measurements so far.
    #[must_use]
    pub fn measurements(&self) -> usize {
        self.y.len()
    }

    /// Forgets all measurements. The solution stays as the start of the next contact's; convex methods end up the same
    /// from any start.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.y.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Gaussian, NnLasso, NnLmmse, Noise, Penalty};
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    const UNKNOWNS: usize = 30;

    /// ±1 rows and noiseless measurements of four atoms.
    fn planted() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut x = vec![0.0; UNKNOWNS];
        [(3, 1.0), (4, 1.6), (17, 0.7), (25, 1.2)]
            .into_iter()
            .for_each(|(k, v)| x[k] = v);
        let rows: Vec<f64> = (0..40 * UNKNOWNS)
            .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        let y = rows
            .chunks(UNKNOWNS)
            .map(|row| row.iter().zip(&x).map(|(a, b)| a * b).sum())
            .collect();
        (x, rows, y)
    }

    /// Every warm solution is the cold one of the same rows, and the last is the planted one.
    fn refines(method: &(impl Recover + Clone), agree: f64, recovered: f64) {
        let (x, rows, y) = planted();
        let mut progressive = Progressive::new(method.clone(), UNKNOWNS);
        let (mut warm, mut cold, mut first) = (vec![0.0; UNKNOWNS], vec![0.0; UNKNOWNS], f64::NAN);
        let error = |image: &[f64]| -> f64 { image.iter().zip(&x).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() };
        for (m, (row, &sample)) in rows.chunks(UNKNOWNS).zip(&y).enumerate() {
            progressive.observe(row, sample).unwrap().scatter(&mut warm);
            let operator = MatrixView::new(m + 1, UNKNOWNS, &rows[..(m + 1) * UNKNOWNS]).unwrap();
            let problem = Problem::new(operator, &y[..=m]).unwrap();
            let solution = method.recover(&problem, &mut Workspace::default()).unwrap();
            solution.scatter(&mut cold);
            // where several solutions are equally good, they still fit equally well
            let fit = (progressive.solution().residual_norm - solution.residual_norm).abs();
            assert!(fit < agree, "M = {}: residuals differ by {fit}", m + 1);
            if m + 1 > UNKNOWNS {
                assert!(warm.iter().zip(&cold).all(|(a, b)| (a - b).abs() < agree));
            }
            if m == 0 {
                first = error(&warm);
            }
        }
        assert_eq!(progressive.measurements(), 40);
        let last = error(&warm);
        assert!(last < recovered && first > 1.0, "{first} after one, {last} after all");
        progressive.clear();
        assert_eq!(progressive.measurements(), 0);
        progressive.observe(&rows[..UNKNOWNS], y[0]).unwrap();
    }

    #[test]
    fn solutions_get_better_and_equal_cold_ones() {
        // a duality gap of 1e-12 ‖y‖²/2M leaves a residual to about 1e-6 ‖y‖ ≈ 1e-5; a weak penalty biases by about
        // itself
        let mut lasso = NnLasso::new(Penalty::Relative(1e-3)).unwrap();
        lasso.stopping.tol = 1e-12;
        refines(&lasso, 1e-4, 0.02);
        let prior = Arc::new(Gaussian::white(UNKNOWNS, 1.0).unwrap());
        // exact from any start; the prior shrinks by about σ²/(M·1) = 2.5e-6
        let lmmse = NnLmmse::new(prior, Noise::Absolute(1e-2)).unwrap();
        refines(&lmmse, 1e-7, 1e-4);
    }

    #[test]
    fn a_refused_measurement_does_not_count() {
        let (_, rows, y) = planted();
        let mut progressive = Progressive::new(NnLasso::new(Penalty::Relative(0.1)).unwrap(), UNKNOWNS);
        progressive.observe(&rows[..UNKNOWNS], y[0]).unwrap();
        let before = progressive.solution().clone();
        assert!(matches!(
            progressive.observe(&rows[..UNKNOWNS - 1], 1.0),
            Err(RecoverError::Columns { .. })
        ));
        assert!(matches!(
            progressive.observe(&rows[..UNKNOWNS], f64::NAN),
            Err(RecoverError::NotFinite { index: 1, .. })
        ));
        assert_eq!((progressive.measurements(), progressive.solution()), (1, &before));
    }
}
