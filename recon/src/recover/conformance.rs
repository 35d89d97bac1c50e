//! Properties that every recovery algorithm must have.

use crate::checks::not_finite;
use crate::kernels::norm;
use crate::matrix::Matrix;
use crate::problem::{Problem, Recover, Solution, Workspace};
use crate::recover::{Build, BuildRegularised};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;

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
        Self { name, rng: ChaCha8Rng::seed_from_u64(1), used: Workspace::default() }
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
    fn attempt(&mut self, method: &dyn Recover, a: &Matrix, y: &[f64]) -> Result<Solution, Refusal> {
        let name = self.name;
        let problem = Problem::new(a.view(), y)?;
        let fresh = method.recover(&problem, &mut Workspace::default());
        let mut used =
            Solution { support: vec![usize::MAX; 3], coefficients: vec![f64::NAN; 2], residual_norm: f64::NAN };
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
        assert!(sorted.iter().all(|&k| k < a.ncols()), "{name}: an atom that does not exist");
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
        }
    }

    /// NaN and infinity in `y` are refused, in the operator as well unless the algorithm does not look there.
    fn not_finite(&mut self, method: &dyn Recover, k: usize) {
        let (mut a, mut y) = (self.matrix(20, k), self.vector(20));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let entry = std::mem::replace(&mut a.row_mut(3)[7], bad);
            if let Err(error) = self.attempt(method, &a, &y) {
                let error = error.to_string();
                assert!(
                    error.starts_with("operator[3, 7] = ") || error.starts_with("the coefficient of atom "),
                    "{}: an operator that holds {bad} gave {error}",
                    self.name
                );
            }
            a.row_mut(3)[7] = entry;
            let value = std::mem::replace(&mut y[4], bad);
            let error = self.attempt(method, &a, &y).map(|_| ());
            assert_eq!(error, Err(not_finite(4, bad)), "{}: y[4] = {bad}", self.name);
            y[4] = value;
        }
    }
}

fn product(a: &Matrix, x: &[f64]) -> Vec<f64> {
    (0..a.nrows()).map(|r| a.row(r).iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Runs the conformance suite on the algorithm built by `build`. It must recover single atoms and sparse non-negative
/// signals in an easy regime, respect the given sparsity, follow the order of the columns, not depend on earlier uses
/// of its workspace, solve degenerate problems with finite numbers or an error, and refuse values that are not finite.
///
/// # Panics
/// If a property fails; the message names it.
pub fn conformance(name: &str, build: Build) {
    let mut suite = Pursuits { suite: Suite::new(name), build };
    suite.planted_signals();
    suite.order_of_columns();
    suite.twins();
    for sparsity in [0, 1, 5, 100] {
        suite.suite.extremes(&|_| build(sparsity));
    }
    suite.suite.not_finite(&*build(5), 60);
}

struct Pursuits<'a> {
    suite: Suite<'a>,
    build: Build,
}

impl Pursuits<'_> {
    /// A solution with no more atoms than it may have.
    fn solve(&mut self, sparsity: usize, a: &Matrix, y: &[f64]) -> Solution {
        let solution = self.suite.solve(&*(self.build)(sparsity), a, y);
        let atoms = solution.support.len();
        assert!(atoms <= sparsity, "{}: {atoms} atoms, not {sparsity}", self.suite.name);
        let (residual, length) = (solution.residual_norm, norm(y));
        assert!(residual <= length * (1.0 + 1e-12), "{}: residual {residual} above ‖y‖ = {length}", self.suite.name);
        solution
    }

    /// 4 of 100 atoms from 60 measurements: δ = 0.6 and ρ = 0.07, far below the phase transition of every algorithm
    /// here.
    fn planted_signals(&mut self) {
        for _ in 0..20 {
            let a = self.suite.matrix(60, 100);
            let mut x = vec![0.0; 100];
            for _ in 0..4 {
                x[self.suite.rng.random_range(0..100)] = self.suite.rng.random_range(0.5..1.5);
            }
            let (solution, name) = (self.solve(4, &a, &product(&a, &x)), self.suite.name);
            let mut found = vec![0.0; 100];
            solution.scatter(&mut found);
            // least squares of condition below 10 on exact data, with a margin of 1e5 for what iterates
            let error = largest_difference(&found, &x);
            assert!(error < 1e-9, "{name}: a planted signal is missed by {error}");
            assert!(solution.residual_norm < 1e-8, "{name}: residual of a planted signal");
        }
    }

    fn order_of_columns(&mut self) {
        let (a, k) = (self.suite.matrix(20, 60), 60);
        let y = self.suite.vector(20);
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
        assert_eq!(found, moved, "{}: another order of the columns", self.suite.name);
    }

    /// A planted atom that is there twice, and one that is zero.
    fn twins(&mut self) {
        let mut a = self.suite.matrix(20, 60);
        a.set_column(1, &a.column(0));
        a.set_column(2, &[0.0; 20]);
        let planted = self.solve(3, &a, &a.column(0));
        let (y, name) = (self.suite.vector(20), self.suite.name);
        assert!(planted.residual_norm < 1e-8, "{name}: a duplicate column");
        let support = self.solve(20, &a, &y).support;
        assert!(!support.contains(&2), "{name}: a zero column is of no use");
    }
}

/// Unknowns of the problems on which answers are compared.
const K: usize = 24;

/// Runs the conformance suite on the algorithm built by `build`. It must recover a sparse signal from twice as many
/// measurements as unknowns, scale with its measurements, follow a reversed order of the unknowns, not depend on
/// earlier uses of its workspace, solve degenerate problems with finite numbers or an error, and refuse values that are
/// not finite.
///
/// # Panics
/// If a property fails; the message names it.
pub fn conformance_regularised(name: &str, build: BuildRegularised) {
    let make = |k: usize| build(k).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut suite = Regularised { suite: Suite::new(name), method: make(K) };
    suite.planted();
    suite.symmetries();
    suite.suite.extremes(&make);
    suite.suite.not_finite(&*suite.method, K);
}

struct Regularised<'a> {
    suite: Suite<'a>,
    method: Box<dyn Recover>,
}

impl Regularised<'_> {
    fn solve(&mut self, a: &Matrix, y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; a.ncols()];
        self.suite.solve(&*self.method, a, y).scatter(&mut x);
        x
    }

    /// Neighbours of equal height, so that the planted signal is sparse, non-negative and of small variation.
    fn planted(&mut self) {
        let a = self.suite.matrix(2 * K, K);
        let mut planted = vec![0.0; K];
        for k in [3, 4, 5, 17] {
            planted[k] = 1.0;
        }
        let found = self.solve(&a, &product(&a, &planted));
        // penalties and noises of the table are 1e-3 of the signal; 50 of them is still a twentieth of the planted
        // height
        assert_near(self.suite.name, "a planted signal", &found, &planted, 0.05);
    }

    fn symmetries(&mut self) {
        let (a, y) = (self.suite.matrix(K / 2, K), self.suite.vector(K / 2));
        let x = self.solve(&a, &y);
        let doubled: Vec<f64> = y.iter().map(|v| 2.0 * v).collect();
        let expected: Vec<f64> = x.iter().map(|v| 2.0 * v).collect();
        let twice = self.solve(&a, &doubled);
        // an iteration that stops at a relative gap of 1e-6 knows its answer to about the square root of it
        assert_near(self.suite.name, "twice the measurements", &twice, &expected, 1e-2);
        let columns: Vec<Vec<f64>> = (0..K).rev().map(|k| a.column(k)).collect();
        let mut turned = self.solve(&Matrix::from_column_slices(a.nrows(), &columns), &y);
        turned.reverse();
        assert_near(self.suite.name, "the unknowns in reverse order", &turned, &x, 1e-2);
    }
}

/// Asserts that `got` equals `expected` to `tolerance` of its largest entry.
fn assert_near(name: &str, what: &str, got: &[f64], expected: &[f64], tolerance: f64) {
    let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (k, (g, e)) in got.iter().zip(expected).enumerate() {
        assert!((g - e).abs() <= tolerance * largest, "{name}: {what}: entry {k} is {g}, expected {e}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recover::{RECOVER, REGULARISED};

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
