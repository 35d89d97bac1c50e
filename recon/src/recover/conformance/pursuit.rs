//! Properties of algorithms that are given a number of atoms.

use super::super::Build;
use super::{Suite, largest_difference, product};
use crate::matrix::Matrix;
use crate::problem::Solution;
use rand::RngExt as _;

/// Runs the conformance suite on the algorithm built by `build`. It must recover single atoms and sparse non-negative
/// signals in an easy regime, respect the given sparsity, follow the scale of `y` and the order of the columns, not
/// depend on earlier uses of its workspace, solve degenerate problems with finite numbers or an error, and refuse
/// values that are not finite.
///
/// # Panics
/// If a property fails; the message names it.
pub fn conformance(name: &str, build: Build) {
    let mut suite = Pursuits {
        suite: Suite::new(name),
        build,
    };
    suite.single_atoms();
    suite.planted_signals();
    suite.sparsity();
    suite.scale_of_measurements();
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
        solution
    }

    fn single_atoms(&mut self) {
        let (m, k) = (20, 60);
        let a = self.suite.matrix(m, k);
        for planted in [0, 17, k - 1] {
            let y: Vec<f64> = a.column(planted).iter().map(|v| 2.5 * v).collect();
            let (solution, name) = (self.solve(1, &a, &y), self.suite.name);
            assert_eq!(solution.support, [planted], "{name}: a single planted atom");
            let coefficient = solution.coefficients[0];
            assert!(
                (coefficient - 2.5).abs() < 1e-9,
                "{name}: coefficient {coefficient} for 2.5"
            );
        }
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

    fn sparsity(&mut self) {
        for (m, k) in [(20, 60), (1, 1), (1, 30), (30, 12), (12, 12)] {
            let (a, y) = (self.suite.matrix(m, k), self.suite.vector(m));
            let low = self.suite.low_rank(m, k);
            for sparsity in [0, 1, 5, m, m + 1, k + 10] {
                let length = y.iter().map(|v| v * v).sum::<f64>().sqrt();
                for a in [&a, &low] {
                    let residual = self.solve(sparsity, a, &y).residual_norm;
                    assert!(
                        residual <= length * (1.0 + 1e-12),
                        "{}: residual {residual} above ‖y‖ = {length}",
                        self.suite.name
                    );
                }
            }
        }
    }

    /// Powers of two change no digit, so that every decision stays what it was.
    fn scale_of_measurements(&mut self) {
        let (a, y) = (self.suite.matrix(20, 60), self.suite.vector(20));
        let unit = self.solve(5, &a, &y);
        for exponent in [-40, -1, 1, 40] {
            let scale = 2.0_f64.powi(exponent);
            let scaled: Vec<f64> = y.iter().map(|v| v * scale).collect();
            let (solution, name) = (self.solve(5, &a, &scaled), self.suite.name);
            assert_eq!(solution.support, unit.support, "{name}: support at scale 2^{exponent}");
            let back: Vec<f64> = solution.coefficients.iter().map(|c| c / scale).collect();
            let error = largest_difference(&back, &unit.coefficients);
            assert!(
                error < 1e-9,
                "{name}: coefficients at scale 2^{exponent} are off by {error}"
            );
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
