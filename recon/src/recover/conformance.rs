//! What every recovery algorithm must satisfy.

use super::Build;
use crate::matrix::Matrix;
use crate::problem::{Problem, RecoverError, Solution, Workspace};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Runs the conformance suite on the algorithm built by `build`: recovers single atoms and sparse non-negative signals in an easy
/// regime, keeps the sparsity it was given, follows the scale of `y` and the order of the columns, does not depend on the history of
/// its workspace, answers degenerate problems with finite numbers or an error, and refuses what is not finite.
///
/// # Panics
/// When a property does not hold; the message names it.
pub fn conformance(name: &str, build: Build) {
    let mut suite = Suite {
        name,
        build,
        rng: ChaCha8Rng::seed_from_u64(1),
        used: Workspace::default(),
    };
    suite.single_atoms();
    suite.planted_signals();
    suite.sparsity_and_workspace();
    suite.scale_of_measurements();
    suite.order_of_columns();
    suite.degenerate_matrices();
    suite.extreme_scales();
    suite.not_finite();
}

struct Suite<'a> {
    name: &'a str,
    build: Build,
    rng: ChaCha8Rng,
    /// A workspace that has seen every problem before.
    used: Workspace,
}

impl Suite<'_> {
    fn vector(&mut self, len: usize) -> Vec<f64> {
        (0..len).map(|_| self.rng.random_range(-1.0..1.0)).collect()
    }

    fn matrix(&mut self, m: usize, k: usize) -> Matrix {
        let values = self.vector(m * k);
        Matrix::from_rows(m, k, values).unwrap_or_else(|e| panic!("{}: {e}", self.name))
    }

    /// Solution in a used and in a fresh workspace, which must be the same.
    fn attempt(&mut self, sparsity: usize, a: &Matrix, y: &[f64]) -> Result<Solution, RecoverError> {
        let algorithm = (self.build)(sparsity);
        let problem = Problem::new(a.view(), y)?;
        let fresh = algorithm.recover(&problem, &mut Workspace::default());
        let mut used = Solution {
            support: vec![usize::MAX; 3],
            coefficients: vec![f64::NAN; 2],
            residual_norm: f64::NAN,
        };
        match algorithm.recover_into(&problem, &mut self.used, &mut used) {
            Ok(()) => assert_eq!(
                fresh.as_ref(),
                Ok(&used),
                "{}: the workspace leaks into the result",
                self.name
            ),
            Err(e) => assert!(fresh.is_err(), "{}: {e} in a used workspace only", self.name),
        }
        fresh
    }

    /// A solution, which must exist and be sound.
    fn solve(&mut self, sparsity: usize, a: &Matrix, y: &[f64]) -> Solution {
        let solution = self
            .attempt(sparsity, a, y)
            .unwrap_or_else(|e| panic!("{}: {e}", self.name));
        self.assert_sound(sparsity, a, &solution);
        solution
    }

    fn assert_sound(&self, sparsity: usize, a: &Matrix, solution: &Solution) {
        let (name, support) = (self.name, &solution.support);
        assert_eq!(support.len(), solution.coefficients.len(), "{name}: lengths");
        assert!(
            support.len() <= sparsity,
            "{name}: {} atoms, not {sparsity}",
            support.len()
        );
        assert!(
            solution.coefficients.iter().all(|c| c.is_finite()) && solution.residual_norm.is_finite(),
            "{name}: a solution that is not finite at sparsity {sparsity}"
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

    fn single_atoms(&mut self) {
        let (m, k) = (20, 60);
        let a = self.matrix(m, k);
        for planted in [0, 17, k - 1] {
            let y: Vec<f64> = a.column(planted).iter().map(|v| 2.5 * v).collect();
            let solution = self.solve(1, &a, &y);
            assert_eq!(solution.support, [planted], "{}: a single planted atom", self.name);
            let coefficient = solution.coefficients[0];
            assert!(
                (coefficient - 2.5).abs() < 1e-9,
                "{}: coefficient {coefficient} for 2.5",
                self.name
            );
        }
        let zero = self.solve(5, &a, &vec![0.0; m]);
        assert!(zero.coefficients.iter().all(|c| *c == 0.0), "{}: zero y", self.name);
    }

    /// 4 of 100 atoms from 60 measurements: δ = 0.6 and ρ = 0.07, far below the phase transition of every algorithm here.
    fn planted_signals(&mut self) {
        for _ in 0..20 {
            let a = self.matrix(60, 100);
            let mut x = vec![0.0; 100];
            for _ in 0..4 {
                x[self.rng.random_range(0..100)] = self.rng.random_range(0.5..1.5);
            }
            let y = product(&a, &x);
            let solution = self.solve(4, &a, &y);
            let mut found = vec![0.0; 100];
            for (&k, &c) in solution.support.iter().zip(&solution.coefficients) {
                found[k] = c;
            }
            // least squares of condition below 10 on exact data, with a margin of 1e5 for what iterates
            let error = largest_difference(&found, &x);
            assert!(error < 1e-9, "{}: a planted signal is missed by {error}", self.name);
            assert!(
                solution.residual_norm < 1e-8,
                "{}: residual of a planted signal",
                self.name
            );
        }
    }

    fn sparsity_and_workspace(&mut self) {
        for (m, k) in [(20, 60), (1, 1), (1, 30), (30, 12), (12, 12)] {
            let (a, y) = (self.matrix(m, k), self.vector(m));
            for sparsity in [0, 1, 5, m, m + 1, k + 10] {
                let solution = self.solve(sparsity, &a, &y);
                let length = y.iter().map(|v| v * v).sum::<f64>().sqrt();
                assert!(
                    solution.residual_norm <= length * (1.0 + 1e-12),
                    "{}: residual {} above ‖y‖ = {length}",
                    self.name,
                    solution.residual_norm
                );
            }
        }
    }

    /// Powers of two change no digit, so that every decision stays what it was.
    fn scale_of_measurements(&mut self) {
        let (a, y) = (self.matrix(20, 60), self.vector(20));
        let unit = self.solve(5, &a, &y);
        for exponent in [-40, -1, 1, 40] {
            let scale = 2.0_f64.powi(exponent);
            let scaled: Vec<f64> = y.iter().map(|v| v * scale).collect();
            let solution = self.solve(5, &a, &scaled);
            assert_eq!(
                solution.support, unit.support,
                "{}: support at scale 2^{exponent}",
                self.name
            );
            let back: Vec<f64> = solution.coefficients.iter().map(|c| c / scale).collect();
            let error = largest_difference(&back, &unit.coefficients);
            assert!(
                error < 1e-9,
                "{}: coefficients at scale 2^{exponent} are off by {error}",
                self.name
            );
        }
    }

    fn order_of_columns(&mut self) {
        let (a, k) = (self.matrix(20, 60), 60);
        let y = self.vector(20);
        let mut turned = Matrix::zeros(20, k);
        for c in 0..k {
            // 7 and 60 have no common factor: every column has its place
            turned.set_column((7 * c + 3) % k, &a.column(c));
        }
        let (plain, turned) = (self.solve(5, &a, &y), self.solve(5, &turned, &y));
        let mut moved: Vec<usize> = plain.support.iter().map(|c| (7 * c + 3) % k).collect();
        let mut found = turned.support;
        moved.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, moved, "{}: another order of the columns", self.name);
    }

    fn degenerate_matrices(&mut self) {
        let (m, k) = (20, 60);
        let (mut a, y) = (self.matrix(m, k), self.vector(m));
        a.set_column(1, &a.column(0));
        a.set_column(2, &vec![0.0; m]);
        let solution = self.solve(m, &a, &y);
        assert!(
            !solution.support.contains(&2),
            "{}: a zero column is of no use",
            self.name
        );
        // a planted atom that is there twice
        let planted = self.solve(3, &a, &a.column(0));
        assert!(planted.residual_norm < 1e-8, "{}: a duplicate column", self.name);
        self.solve(5, &Matrix::zeros(m, k), &y);
        // rank 3
        let (left, right) = (self.matrix(m, 3), self.matrix(3, k));
        let mut low = Matrix::zeros(m, k);
        for r in 0..m {
            right.accumulate_row(left.row(r), low.row_mut(r));
        }
        for sparsity in [2, 5, m] {
            self.solve(sparsity, &low, &y);
        }
    }

    /// Finite numbers, or an error where the answer is beyond the range of numbers.
    fn extreme_scales(&mut self) {
        let (a, y) = (self.matrix(20, 60), self.vector(20));
        let scales = [1e-300, 1e-150, 1.0, 1e150, 1e300];
        for y_scale in scales {
            let y: Vec<f64> = y.iter().map(|v| v * y_scale).collect();
            self.solve(5, &a, &y);
            for a_scale in scales {
                let a = Matrix::from_rows(20, 60, a.view().values().iter().map(|v| v * a_scale).collect());
                let a = a.unwrap_or_else(|e| panic!("{}: {e}", self.name));
                if let Ok(solution) = self.attempt(5, &a, &y) {
                    self.assert_sound(5, &a, &solution);
                }
            }
        }
    }

    fn not_finite(&mut self) {
        let (mut a, mut y) = (self.matrix(20, 60), self.vector(20));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            a.row_mut(3)[7] = bad;
            // where the algorithm does not look at the entry, its answer must be sound
            if let Ok(solution) = self.attempt(5, &a, &y) {
                self.assert_sound(5, &a, &solution);
            }
            a.row_mut(3)[7] = 0.0;
            let value = std::mem::replace(&mut y[4], bad);
            let error = self.attempt(5, &a, &y);
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
    use super::super::RECOVER;
    use super::*;

    #[test]
    fn every_algorithm_conforms() {
        for (name, build) in RECOVER {
            conformance(name, *build);
        }
    }
}
