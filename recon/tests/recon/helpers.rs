//! What several tests need.

use nalgebra::DMatrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;
use spts_recon::recover::Gaussian;
use spts_recon::{Matrix, Problem, Recover, Workspace};
use std::sync::Arc;

/// Whether `result` is refused, with a sentence that has this part.
pub(crate) fn says<T>(result: &Result<T, Refusal>, part: &str) -> bool {
    result.as_ref().is_err_and(|error| error.to_string().contains(part))
}

/// Asserts that `found` equals `expected` to `tolerance` of its largest entry.
#[track_caller]
pub(crate) fn assert_near(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs();
        assert!(error <= tolerance * largest, "{what}: entry {k} is {found}, expected {expected}");
    }
}

/// All unknowns that `method` finds.
pub(crate) fn solve(method: &dyn Recover, a: &Matrix, y: &[f64]) -> Vec<f64> {
    let problem = Problem::new(a.view(), y).unwrap();
    let mut x = vec![0.0; a.ncols()];
    method.recover(&problem, &mut Workspace::default()).unwrap().scatter(&mut x);
    x
}

/// `m` × `n` signs.
pub(crate) fn signs(rng: &mut ChaCha8Rng, m: usize, n: usize) -> Matrix {
    let signs = (0..m * n).map(|_| if rng.random() { 1.0 } else { -1.0 });
    Matrix::from_rows(m, n, signs.collect()).unwrap()
}

/// A prior of `n` pixels with the mean `mean`.
pub(crate) fn prior(rng: &mut ChaCha8Rng, n: usize, mean: f64) -> Arc<Gaussian> {
    let root = DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
    let covariance = &root * root.transpose() / n as f64 + 0.05 * DMatrix::identity(n, n);
    Arc::new(Gaussian::new(vec![mean; n], Matrix::from(&covariance)).unwrap())
}

/// A prior with the mean `mean`, rows of ±1, and samples with some noise of an image of which a third is pressed.
pub(crate) fn drawn(seed: u64, m: usize, n: usize, mean: f64) -> (Arc<Gaussian>, Matrix, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (prior, rows) = (prior(&mut rng, n, mean), signs(&mut rng, m, n));
    let image: Vec<f64> = (0..n).map(|k| if k % 3 == 0 { rng.random_range(0.5..2.0) } else { 0.0 }).collect();
    let sum = |r: usize| rows.row(r).iter().zip(&image).map(|(w, x)| w * x).sum::<f64>();
    let y = (0..m).map(|r| sum(r) + rng.random_range(-0.1..0.1)).collect();
    (prior, rows, y)
}
