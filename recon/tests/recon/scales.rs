//! Scales at which squares overflow or vanish.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{BatchOmp, Build, RECOVER};
use spts_recon::{Matrix, Problem, RecoverError, Solution, Workspace};

fn draw(m: usize, k: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut values = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    (values(m * k), values(m))
}

/// The pursuits that scale their problem first.
fn scaling() -> impl Iterator<Item = &'static (&'static str, Build)> {
    RECOVER.iter().filter(|(name, _)| *name != "reference")
}

/// By a power of two the answer keeps every digit.
#[test]
fn operators_and_measurements_of_any_scale_are_the_same_problem() {
    let (m, k, s) = (20, 60, 5);
    let (values, y) = draw(m, k);
    let scaled = |v: &[f64], e: i32| -> Vec<f64> { v.iter().map(|v| v * 2.0_f64.powi(e)).collect() };
    for (name, build) in scaling() {
        let solve = |a_exponent, y_exponent| {
            let a = Matrix::from_rows(m, k, scaled(&values, a_exponent)).unwrap();
            let y = scaled(&y, y_exponent);
            build(s).recover(&Problem::new(a.view(), &y).unwrap(), &mut Workspace::default())
        };
        let unit = solve(0, 0).unwrap();
        for (a_exponent, y_exponent) in [
            (-900, 0),
            (900, 0),
            (-900, -900),
            (900, 900),
            (0, 1000),
            (0, -900),
            (500, -400),
        ] {
            let got = solve(a_exponent, y_exponent).unwrap();
            assert_eq!(got.support, unit.support, "{name}: A·2^{a_exponent}, y·2^{y_exponent}");
            for (g, e) in got.coefficients.iter().zip(&unit.coefficients) {
                let back = g * 2.0_f64.powi(a_exponent - y_exponent);
                // iterations may end one step apart
                assert!((back - e).abs() <= 1e-9 * e.abs(), "{name}: {back}, expected {e}");
            }
        }
        assert!(
            matches!(solve(-1000, 1000), Err(RecoverError::Overflow { .. })),
            "{name}"
        );
    }
}

#[test]
fn a_shared_operator_of_any_scale_is_the_same_problem() {
    let (m, k) = (20, 60);
    let (values, y) = draw(m, k);
    let solve = |a_scale: f64, y_scale: f64| {
        let a = Matrix::from_rows(m, k, values.iter().map(|v| v * a_scale).collect()).unwrap();
        let y: Vec<f64> = y.iter().map(|v| v * y_scale).collect();
        let mut solution = Solution::default();
        let result = BatchOmp::new(a.view(), 5)
            .unwrap()
            .recover_into(&y, &mut Workspace::default(), &mut solution);
        result.map(|()| solution)
    };
    let unit = solve(1.0, 1.0).unwrap();
    for scale in [2.0_f64.powi(-900), 2.0_f64.powi(900)] {
        let got = solve(scale, scale).unwrap();
        assert_eq!(
            (got.support, got.coefficients),
            (unit.support.clone(), unit.coefficients.clone())
        );
    }
    assert!(matches!(solve(1e-300, 1e300), Err(RecoverError::Overflow { .. })));
    let zero = solve(1.0, 0.0).unwrap();
    assert!(zero.support.is_empty() && zero.residual_norm == 0.0);
}

#[test]
fn an_operator_that_is_not_finite_is_refused() {
    let (mut values, y) = draw(20, 60);
    values[67] = f64::NAN;
    let a = Matrix::from_rows(20, 60, values).unwrap();
    let refused = |error: Option<RecoverError>, name: &str| {
        let expected = matches!(error, Some(RecoverError::OperatorNotFinite { row: 1, col: 7, .. }));
        assert!(expected, "{name}: {error:?}");
    };
    for (name, build) in scaling() {
        let problem = Problem::new(a.view(), &y).unwrap();
        refused(build(3).recover(&problem, &mut Workspace::default()).err(), name);
    }
    refused(BatchOmp::new(a.view(), 3).err(), "BatchOmp");
    assert!(matches!(
        BatchOmp::new(Matrix::zeros(0, 3).view(), 3),
        Err(RecoverError::Empty { rows: 0, cols: 3 })
    ));
}
