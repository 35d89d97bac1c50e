//! What every recovery algorithm must satisfy.

use super::Build;
use crate::matrix::Matrix;
use crate::problem::{Problem, Workspace};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Runs the conformance suite on the algorithm built by `build`: finds a single planted atom, keeps the sparsity it was
/// given, does not depend on the history of its workspace, and answers degenerate problems with finite numbers.
///
/// # Panics
/// When a property does not hold; the message names it.
pub fn conformance(name: &str, build: Build) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (m, k) = (20, 60);
    let values: Vec<f64> = (0..m * k).map(|_| rng.random_range(-1.0..1.0)).collect();
    let a = Matrix::from_rows(m, k, values).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut shared = Workspace::default();
    for planted in [0, 17, k - 1] {
        let y: Vec<f64> = a.column(planted).iter().map(|v| 2.5 * v).collect();
        let solution = solve(name, build, 1, &a, &y, &mut shared);
        assert_eq!(solution.0, [planted], "{name}: a single planted atom");
        assert!(
            (solution.1[0] - 2.5).abs() < 1e-9,
            "{name}: coefficient {} for 2.5",
            solution.1[0]
        );
    }
    let y: Vec<f64> = (0..m).map(|_| rng.random_range(-1.0..1.0)).collect();
    for sparsity in [0, 1, 5, m, k + 10] {
        let used = solve(name, build, sparsity, &a, &y, &mut shared);
        let fresh = solve(name, build, sparsity, &a, &y, &mut Workspace::default());
        assert!(used.0.len() <= sparsity, "{name}: sparsity {sparsity}");
        assert_eq!(used, fresh, "{name}: the workspace leaks into the result");
    }
    let zero = vec![0.0; m];
    assert!(
        solve(name, build, 5, &a, &zero, &mut shared).0.is_empty(),
        "{name}: zero y"
    );
    for scale in [1e-300, 1e-150, 1e150, 1e300] {
        let y: Vec<f64> = y.iter().map(|v| v * scale).collect();
        solve(name, build, 5, &a, &y, &mut shared);
    }
    let mut degenerate = a.clone();
    degenerate.set_column(1, &a.column(0));
    degenerate.set_column(2, &vec![0.0; m]);
    solve(name, build, m, &degenerate, &y, &mut shared);
}

fn solve(
    name: &str,
    build: Build,
    sparsity: usize,
    a: &Matrix,
    y: &[f64],
    work: &mut Workspace,
) -> (Vec<usize>, Vec<f64>) {
    let problem = Problem::new(a.view(), y).unwrap_or_else(|e| panic!("{name}: {e}"));
    let solution = build(sparsity)
        .recover(&problem, work)
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(solution.support.len(), solution.coefficients.len(), "{name}: lengths");
    assert!(
        solution.coefficients.iter().all(|c| c.is_finite()) && solution.residual_norm.is_finite(),
        "{name}: a solution that is not finite at sparsity {sparsity}"
    );
    (solution.support, solution.coefficients)
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
