//! Properties that every recovery algorithm must have. Common ones are in this file; those of one kind have a file of
//! their own.

mod pursuit;
mod regularised;

pub use pursuit::conformance;
pub use regularised::conformance_regularised;

use crate::matrix::Matrix;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Scales at which squares, and products of two of them, leave the range of numbers.
const SCALES: [f64; 5] = [1e-300, 1e-150, 1.0, 1e150, 1e300];

/// An algorithm for problems with so many unknowns.
type Make<'a> = &'a dyn Fn(usize) -> Box<dyn Recover>;

/// The algorithm under test, and what the checks draw their problems from.
struct Suite<'a> {
    name: &'a str,
    rng: ChaCha8Rng,
    /// A workspace that has been used for every problem before.
    used: Workspace,
}

impl<'a> Suite<'a> {
    fn new(name: &'a str) -> Self {
        Self {
            name,
            rng: ChaCha8Rng::seed_from_u64(1),
            used: Workspace::default(),
        }
    }

    fn vector(&mut self, len: usize) -> Vec<f64> {
        (0..len).map(|_| self.rng.random_range(-1.0..1.0)).collect()
    }

    fn matrix(&mut self, m: usize, k: usize) -> Matrix {
        let values = self.vector(m * k);
        self.filled(m, k, values)
    }

    fn filled(&self, m: usize, k: usize, values: Vec<f64>) -> Matrix {
        Matrix::from_rows(m, k, values).unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }

    /// Rank 3: a product of two random matrices.
    fn low_rank(&mut self, m: usize, k: usize) -> Matrix {
        let (left, right) = (self.matrix(m, 3), self.matrix(3, k));
        let mut low = Matrix::zeros(m, k);
        for r in 0..m {
            right.accumulate_row(left.row(r), low.row_mut(r));
        }
        low
    }

    /// A sound solution or an error. It is the same in a used and in a fresh workspace.
    fn attempt(&mut self, method: &dyn Recover, a: &Matrix, y: &[f64]) -> Result<Solution, RecoverError> {
        let name = self.name;
        let problem = Problem::new(a.view(), y)?;
        let fresh = method.recover(&problem, &mut Workspace::default());
        let mut used = Solution {
            support: vec![usize::MAX; 3],
            coefficients: vec![f64::NAN; 2],
            residual_norm: f64::NAN,
        };
        match method.recover_into(&problem, &mut self.used, &mut used) {
            Ok(()) => assert_eq!(fresh.as_ref(), Ok(&used), "{name}: the workspace leaks into the result"),
            Err(e) => assert!(fresh.is_err(), "{name}: {e} in a used workspace only"),
        }
        if let Ok(solution) = &fresh {
            self.assert_sound(a, solution);
        }
        fresh
    }

    /// A solution, which must exist and be sound.
    fn solve(&mut self, method: &dyn Recover, a: &Matrix, y: &[f64]) -> Solution {
        let solution = self.attempt(method, a, y);
        solution.unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }

    fn assert_sound(&self, a: &Matrix, solution: &Solution) {
        let (name, support) = (self.name, &solution.support);
        assert_eq!(support.len(), solution.coefficients.len(), "{name}: lengths");
        assert!(
            solution.coefficients.iter().all(|c| c.is_finite()) && solution.residual_norm.is_finite(),
            "{name}: a solution that is not finite"
        );
        let mut sorted = support.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert!(sorted.len() == support.len(), "{name}: an atom twice");
        assert!(
            sorted.iter().all(|&k| k < a.ncols()),
            "{name}: an atom that does not exist"
        );
    }

    /// Finite numbers for every problem at an ordinary scale, and finite numbers or an error at any other.
    fn extremes(&mut self, make: Make<'_>) {
        for (m, k) in [(1, 1), (1, 30), (30, 12), (12, 12), (20, 60)] {
            let (method, a, y) = (make(k), self.matrix(m, k), self.vector(m));
            self.solve(&*method, &a, &y);
            let zero = self.solve(&*method, &a, &vec![0.0; m]);
            let name = self.name;
            assert!(zero.coefficients.iter().all(|c| *c == 0.0), "{name}: zero y");
            self.solve(&*method, &Matrix::zeros(m, k), &y);
            let low = self.low_rank(m, k);
            self.solve(&*method, &low, &y);
            if k > 2 {
                let mut twins = a.clone();
                twins.set_column(1, &a.column(0));
                twins.set_column(2, &vec![0.0; m]);
                self.solve(&*method, &twins, &y);
            }
            self.scales(&*method, &a, &y);
        }
    }

    fn scales(&mut self, method: &dyn Recover, a: &Matrix, y: &[f64]) {
        for y_scale in SCALES {
            let y: Vec<f64> = y.iter().map(|v| v * y_scale).collect();
            for a_scale in SCALES {
                let values = a.view().values().iter().map(|v| v * a_scale).collect();
                let a = self.filled(a.nrows(), a.ncols(), values);
                // an answer that a double cannot hold is an error; `attempt` has checked any other
                let _ = self.attempt(method, &a, &y);
            }
        }
    }

    /// NaN and infinity in `y` are refused, in the operator as well unless the algorithm does not look there.
    fn not_finite(&mut self, method: &dyn Recover, k: usize) {
        let (mut a, mut y) = (self.matrix(20, k), self.vector(20));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let entry = std::mem::replace(&mut a.row_mut(3)[7], bad);
            if let Err(error) = self.attempt(method, &a, &y) {
                let named = matches!(error, RecoverError::OperatorNotFinite { row: 3, col: 7, .. });
                assert!(
                    named || matches!(error, RecoverError::Overflow { .. }),
                    "{}: an operator that holds {bad} gave {error:?}",
                    self.name
                );
            }
            a.row_mut(3)[7] = entry;
            let value = std::mem::replace(&mut y[4], bad);
            let error = self.attempt(method, &a, &y);
            assert!(
                matches!(error, Err(RecoverError::NotFinite { index: 4, .. })),
                "{}: y[4] = {bad} gave {error:?}",
                self.name
            );
            y[4] = value;
        }
    }
}

fn product(a: &Matrix, x: &[f64]) -> Vec<f64> {
    (0..a.nrows())
        .map(|r| a.row(r).iter().zip(x).map(|(a, x)| a * x).sum())
        .collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::{RECOVER, REGULARISED};
    use super::*;

    #[test]
    fn every_algorithm_conforms() {
        for (name, build) in RECOVER {
            conformance(name, *build);
        }
        for (name, build) in REGULARISED {
            conformance_regularised(name, *build);
        }
    }
}
