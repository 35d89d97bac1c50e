//! Properties of algorithms that balance fit and prior.

use super::super::BuildRegularised;
use super::{Suite, product};
use crate::matrix::Matrix;
use crate::problem::Recover;

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
    let mut suite = Regularised {
        suite: Suite::new(name),
        method: make(K),
    };
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
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut turned = self.solve(&Matrix::from_column_slices(a.nrows(), &slices), &y);
        turned.reverse();
        assert_near(self.suite.name, "the unknowns in reverse order", &turned, &x, 1e-2);
    }
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
