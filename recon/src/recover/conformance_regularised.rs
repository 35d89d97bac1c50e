//! What every algorithm that weighs fit against a prior must satisfy.

use super::BuildRegularised;
use crate::matrix::Matrix;
use crate::problem::{Problem, Recover, RecoverError, Workspace};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Unknowns of the suite's problems.
const K: usize = 24;

/// Runs the conformance suite on the algorithm built by `build`: recovers a planted sparse signal from twice as many
/// measurements as unknowns, scales with its measurements, follows when the order of the unknowns is turned round, does
/// not depend on the history of its workspace, and answers degenerate problems with finite numbers or an error.
///
/// # Panics
/// When a property does not hold; the message names it.
pub fn conformance_regularised(name: &str, build: BuildRegularised) {
    let suite = Suite {
        name,
        method: build(K).unwrap_or_else(|e| panic!("{name}: {e}")),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    suite.planted(&random(2 * K, &mut rng));
    suite.symmetries(&random(K / 2, &mut rng), &vector(K / 2, &mut rng));
    suite.history(&mut rng);
    suite.degenerate(&mut rng);
}

struct Suite<'a> {
    name: &'a str,
    method: Box<dyn Recover>,
}

impl Suite<'_> {
    fn recover(&self, a: &Matrix, y: &[f64], work: &mut Workspace) -> Result<Vec<f64>, RecoverError> {
        let name = self.name;
        let problem = Problem::new(a.view(), y).unwrap_or_else(|e| panic!("{name}: {e}"));
        let solution = self.method.recover(&problem, work)?;
        assert_eq!(solution.support.len(), solution.coefficients.len(), "{name}: lengths");
        let mut x = vec![0.0; a.ncols()];
        solution.scatter(&mut x);
        assert!(
            x.iter().all(|v| v.is_finite()) && solution.residual_norm.is_finite(),
            "{name}: a solution that is not finite"
        );
        Ok(x)
    }

    fn solve(&self, a: &Matrix, y: &[f64]) -> Vec<f64> {
        self.recover(a, y, &mut Workspace::default())
            .unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }

    /// Neighbours of equal height, so that the planted signal is sparse, non-negative and of small variation.
    fn planted(&self, a: &Matrix) {
        let mut planted = vec![0.0; K];
        for k in [3, 4, 5, 17] {
            planted[k] = 1.0;
        }
        let found = self.solve(a, &product(a, &planted));
        // penalties and noises of the table are 1e-3 of the signal; 50 of them is still a twentieth of the planted height
        assert_near(self.name, "a planted signal", &found, &planted, 0.05);
    }

    fn symmetries(&self, a: &Matrix, y: &[f64]) {
        let x = self.solve(a, y);
        let doubled: Vec<f64> = y.iter().map(|v| 2.0 * v).collect();
        let expected: Vec<f64> = x.iter().map(|v| 2.0 * v).collect();
        // an iteration that stops at a relative gap of 1e-6 knows its answer to about the square root of it
        assert_near(
            self.name,
            "twice the measurements",
            &self.solve(a, &doubled),
            &expected,
            1e-2,
        );
        let columns: Vec<Vec<f64>> = (0..K).rev().map(|k| a.column(k)).collect();
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut turned = self.solve(&Matrix::from_column_slices(a.nrows(), &slices), y);
        turned.reverse();
        assert_near(self.name, "the unknowns in reverse order", &turned, &x, 1e-2);
    }

    fn history(&self, rng: &mut ChaCha8Rng) {
        let mut used = Workspace::default();
        for m in [K, 5, 1, 2 * K, 5] {
            let (a, y) = (random(m, rng), vector(m, rng));
            let again = self.recover(&a, &y, &mut used);
            let fresh = self.recover(&a, &y, &mut Workspace::default());
            assert_eq!(again, fresh, "{}: the workspace leaks into the result", self.name);
            assert!(fresh.is_ok(), "{}: M = {m}: {fresh:?}", self.name);
        }
    }

    fn degenerate(&self, rng: &mut ChaCha8Rng) {
        let name = self.name;
        let (a, y) = (random(K, rng), vector(K, rng));
        assert_eq!(self.solve(&a, &[0.0; K]), [0.0; K], "{name}: zero y");
        let mut twins = a.clone();
        twins.set_column(1, &a.column(0));
        twins.set_column(2, &[0.0; K]);
        self.solve(&twins, &y);
        self.solve(&Matrix::zeros(K, K), &y);
        let mut rank_two = Matrix::zeros(K, K);
        for r in 0..K {
            rank_two.row_mut(r).copy_from_slice(a.row(r % 2));
        }
        self.solve(&rank_two, &y);
        let mut work = Workspace::default();
        for y_scale in [1e-300, 1e-150, 1.0, 1e150, 1e300] {
            for a_scale in [1e-300, 1e-150, 1.0, 1e150, 1e300] {
                let y: Vec<f64> = y.iter().map(|v| v * y_scale).collect();
                let values: Vec<f64> = a.view().values().iter().map(|v| v * a_scale).collect();
                let a = Matrix::from_rows(K, K, values).unwrap_or_else(|e| panic!("{name}: {e}"));
                // an answer that a double cannot hold is an error; `recover` has checked that any other is finite
                let _ = self.recover(&a, &y, &mut work);
            }
        }
        for bad in [f64::NAN, f64::INFINITY] {
            let mut broken = a.clone();
            broken.row_mut(2)[3] = bad;
            let refused = self.recover(&broken, &y, &mut work);
            assert!(
                matches!(refused, Err(RecoverError::OperatorNotFinite { row: 2, col: 3, .. })),
                "{name}: an operator that holds {bad}: {refused:?}"
            );
        }
    }
}

fn random(m: usize, rng: &mut ChaCha8Rng) -> Matrix {
    Matrix::from_rows(m, K, vector(m * K, rng)).unwrap_or_else(|e| panic!("{e}"))
}

fn vector(len: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn product(a: &Matrix, x: &[f64]) -> Vec<f64> {
    (0..a.nrows())
        .map(|r| a.row(r).iter().zip(x).map(|(a, x)| a * x).sum())
        .collect()
}

/// Asserts that `got` equals `expected` to `tolerance` of its largest entry.
fn assert_near(name: &str, what: &str, got: &[f64], expected: &[f64], tolerance: f64) {
    let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (k, (g, e)) in got.iter().zip(expected).enumerate() {
        assert!(
            (g - e).abs() <= tolerance * largest,
            "{name}: {what}: entry {k} is {g}, expected {e}"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::REGULARISED;
    use super::*;

    #[test]
    fn every_algorithm_conforms() {
        for (name, build) in REGULARISED {
            conformance_regularised(name, *build);
        }
    }
}
