//! The regularised algorithms against closed forms, against scikit-learn and scipy (`scripts/oracles/convex.py`), and
//! those for one sensing matrix against those that are given it with every window.

use crate::helpers::{assert_near, drawn, says, solve};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use spts_recon::recover::{Fixed, Gaussian, Lmmse, NnLasso, NnLmmse, Noise, Penalty, Tv};
use spts_recon::{Matrix, Problem, Recover as _, Workspace};
use std::sync::Arc;

/// The generator that the script's problems are made of.
struct Uniform(u32);

impl Uniform {
    fn vector(&mut self, len: usize) -> Vec<f64> {
        (0..len)
            .map(|_| {
                self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(self.0) / 2.0_f64.powi(31) - 1.0
            })
            .collect()
    }
}

/// A and y = A x + noise of a tenth of its amplitude, x with every seventh entry 1.
fn problem(seed: u32, m: usize, k: usize) -> (DMatrix<f64>, Vec<f64>) {
    let mut numbers = Uniform(seed);
    let a = DMatrix::from_row_slice(m, k, &numbers.vector(m * k));
    let noise = numbers.vector(m);
    let planted = DVector::from_fn(k, |i, _| if i % 7 == 3 { 1.0 } else { 0.0 });
    let y = &a * planted + 0.1 * DVector::from_vec(noise);
    (a, y.as_slice().to_vec())
}

fn oracle() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/oracles/convex.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "sizes and seeds of small problems")]
fn case(value: &Value) -> (u32, usize, usize) {
    let get = |key: &str| value[key].as_u64().unwrap();
    (get("seed") as u32, get("m") as usize, get("k") as usize)
}

/// ‖y − A w‖² / (2M) + α Σ w.
fn lasso(a: &DMatrix<f64>, y: &[f64], w: &[f64], alpha: f64) -> f64 {
    let w = DVector::from_column_slice(w);
    (DVector::from_column_slice(y) - a * &w).norm_squared() / (2.0 * y.len() as f64) + alpha * w.sum()
}

#[test]
fn lasso_equals_scikit_learn() {
    for recorded in oracle()["lasso"].as_array().unwrap() {
        let (seed, m, k) = case(recorded);
        let (a, y) = problem(seed, m, k);
        let alpha = recorded["alpha"].as_f64().unwrap();
        let mut method = NnLasso::new(Penalty::Absolute(alpha)).unwrap();
        method.stopping.tol = 1e-13;
        let w = solve(&method, &Matrix::from(&a), &y);
        let expected = numbers(&recorded["w"]);
        let objective = |w: &[f64]| lasso(&a, &y, w, alpha);
        // the gap bounds how far ours is above the smallest objective; the other program's can only be above it as well
        let allowed = 1e-12 * objective(&vec![0.0; k]);
        assert!(objective(&w) <= objective(&expected) + allowed, "case {seed}: objective");
        // a gap of 1e-13 leaves 3e-7 in a coefficient of unit curvature; the curvature on the support is near M/3 > 1,
        // its smallest value some hundredth of that
        assert_near(&w, &expected, 1e-5, &format!("case {seed}"));
    }
}

#[test]
fn non_negative_lmmse_equals_scipy() {
    for recorded in oracle()["gaussian"].as_array().unwrap() {
        let (seed, m, k) = case(recorded);
        let (a, y) = problem(seed, m, k);
        let (prior, _, _) = prior(seed, k);
        let noise = Noise::Absolute(recorded["noise"].as_f64().unwrap());
        let fixed = Fixed::new(Matrix::from(&a).view(), Arc::clone(&prior), noise).unwrap();
        let method = NnLmmse::new(prior, noise).unwrap();
        let x = solve(&method, &Matrix::from(&a), &y);
        // condition of the whole problem below 1e5 in the covariance and 1e4 in A/σ: 1e9·ε with a margin of 10
        assert_near(&x, &numbers(&recorded["x"]), 1e-6, &format!("case {seed}"));
        let mut window = fixed.window();
        window.extend(&y);
        let x = window.non_negative().unwrap();
        assert_near(x, &numbers(&recorded["x"]), 1e-6, &format!("case {seed}, fixed"));
    }
}

/// Prior of the script: root·rootᵀ/k + I/10, mean uniform.
fn prior(seed: u32, k: usize) -> (Arc<Gaussian>, DMatrix<f64>, DVector<f64>) {
    let values = Uniform(seed + 1000).vector(k * (k + 1));
    let root = DMatrix::from_row_slice(k, k, &values[..k * k]);
    let covariance = &root * root.transpose() / k as f64 + 0.1 * DMatrix::identity(k, k);
    let mean = DVector::from_column_slice(&values[k * k..]);
    let gaussian = Gaussian::new(mean.as_slice().to_vec(), Matrix::from(&covariance)).unwrap();
    (Arc::new(gaussian), covariance, mean)
}

/// x̂ = μ + C Aᵀ (A C Aᵀ + σ² I)⁻¹ (y − A μ) by an explicit inverse, for fewer and for more measurements than unknowns:
/// both systems give the same.
#[test]
fn lmmse_equals_the_explicit_formula() {
    for (m, k, deviation) in [(1, 12, 0.5), (5, 12, 0.1), (12, 12, 0.3), (40, 12, 0.2)] {
        let (a, y) = problem(3, m, k);
        let (gaussian, c, mean) = prior(5, k);
        let method = Lmmse::new(gaussian, Noise::Absolute(deviation)).unwrap();
        let rows = Matrix::from(&a);
        let solution = method.recover(&Problem::new(rows.view(), &y).unwrap(), &mut Workspace::default());
        let (solution, mut x) = (solution.unwrap(), vec![0.0; 12]);
        solution.scatter(&mut x);
        let inverse = (&a * &c * a.transpose() + deviation.powi(2) * DMatrix::identity(m, m)).try_inverse().unwrap();
        let gain = &c * a.transpose() * inverse;
        let y = DVector::from_vec(y);
        let expected = &mean + &gain * (&y - &a * &mean);
        // condition below 1e4: 1e4·ε with a margin of 100
        assert_near(&x, expected.as_slice(), 1e-10, &format!("M = {m}"));
        assert!((solution.residual_norm - (&y - &a * &expected).norm()).abs() < 1e-9);
    }
}

/// Two plateaus of n₁ and n₂ pixels, a < b, seen directly: each moves towards the other by λ over its size while they
/// do not meet, and a negative one stays at zero.
#[test]
fn total_variation_of_two_plateaus() {
    let (n1, n2) = (4_usize, 6_usize);
    let a = DMatrix::<f64>::identity(10, 10);
    for (low, high, alpha) in [(1.0, 3.0, 0.08), (0.0, 2.0, 0.05), (1.0, 1.2, 0.5), (-1.0, 2.0, 0.05)] {
        let y: Vec<f64> = (0..10).map(|i| if i < n1 { low } else { high }).collect();
        let penalty = 10.0 * alpha;
        let mean = 0.4 * low + 0.6 * high;
        // the lower plateau may not rise above the mean of all
        let lower = (low + penalty / 4.0_f64).min(mean).max(0.0);
        let upper = if lower > 0.0 && lower >= mean { mean } else { high - penalty / 6.0 };
        let expected: Vec<f64> = (0..10).map(|i| if i < n1 { lower } else { upper }).collect();
        for (rows, cols) in [(1, 10), (10, 1)] {
            let mut method = Tv::new(rows, cols, Penalty::Absolute(alpha)).unwrap();
            method.stopping.tol = 1e-11;
            // a gap of 1e-11 ‖y‖² / 2 in an objective of unit curvature is below 1e-4 in a pixel
            assert_near(&solve(&method, &Matrix::from(&a), &y), &expected, 1e-4, &format!("{low} and {high}"));
        }
        assert_eq!(n1 + n2, 10);
    }
}

/// The same images for any shape, noise and mean; a window that is used again is as new.
#[test]
fn both_estimates_are_those_of_any_operator() {
    for (m, n) in [(1, 1), (1, 9), (5, 9), (20, 60), (30, 30), (50, 20)] {
        for (noise, mean) in [
            (Noise::Relative(0.12), 0.0),
            (Noise::Relative(0.5), 0.3),
            (Noise::Absolute(0.2), 0.0),
            (Noise::Absolute(0.05), -0.4),
        ] {
            let (prior, a, y) = drawn(m as u64, m, n, mean);
            let fixed = Fixed::new(a.view(), Arc::clone(&prior), noise).unwrap();
            assert_eq!((fixed.measurements(), fixed.pixels()), (m, n));
            let linear = solve(&Lmmse::new(Arc::clone(&prior), noise).unwrap(), &a, &y);
            let non_negative = solve(&NnLmmse::new(prior, noise).unwrap(), &a, &y);
            let mut window = fixed.window();
            for round in 0..3 {
                let what = format!("{m} × {n}, {noise:?}, mean {mean}, round {round}");
                window.clear();
                // beyond the last measurement nothing is taken
                window.extend(&[&y[..], &[7.0]].concat());
                // condition of covariance and A/σ below 1e6 together
                assert_near(window.image().unwrap(), &linear, 1e-9, &what);
                assert_near(window.non_negative().unwrap(), &non_negative, 1e-8, &what);
                assert_near(window.image().unwrap(), &linear, 1e-9, &what);
            }
        }
    }
}

/// Hardly any noise and almost nothing else, a silent skin, large and small numbers of the operator and of the samples.
#[test]
fn estimates_stay_finite_at_the_extremes() {
    for noise in [1e-12, 1e-6, 1.0, 1e6] {
        let scales = [(1.0, 1.0), (1e60, 1.0), (1e-60, 1e-60), (1.0, 1e90), (1.0, 0.0)];
        for (which, (operator_scale, sample_scale)) in scales.into_iter().enumerate() {
            for known in [false, true] {
                let (prior, a, y) = drawn(3, 10, 24, 0.0);
                let a: Vec<f64> = a.view().values().iter().map(|w| w * operator_scale).collect();
                let a = Matrix::from_rows(10, 24, a).unwrap();
                let y: Vec<f64> = y.iter().map(|v| v * sample_scale).collect();
                let noise = if known {
                    Noise::Absolute(noise * operator_scale * sample_scale.max(1e-9))
                } else {
                    Noise::Relative(noise)
                };
                let fixed = Fixed::new(a.view(), Arc::clone(&prior), noise).unwrap();
                let mut window = fixed.window();
                window.extend(&y);
                let what = format!("{noise:?}, {operator_scale}, {sample_scale}");
                assert!(window.image().unwrap().iter().all(|x| x.is_finite()), "{what}");
                let image = window.non_negative().unwrap().to_vec();
                assert!(image.iter().all(|x| x.is_finite() && *x >= 0.0), "{what}");
                if which == 0 && !known {
                    let expected = solve(&NnLmmse::new(prior, noise).unwrap(), &a, &y);
                    // at a noise variance of 1e-12 of the signal's, and below, systems have a condition of 1e12
                    let deviation = if let Noise::Relative(share) = noise { share } else { 1.0 };
                    let tolerance = if deviation < 1e-3 { 1e-3 } else { 1e-8 };
                    assert_near(&image, &expected, tolerance, &what);
                }
            }
        }
    }
}

#[test]
fn what_is_no_window_is_refused() {
    let (prior, a, y) = drawn(5, 4, 6, 0.0);
    let other = Arc::new(Gaussian::white(5, 1.0).unwrap());
    let noise = Noise::Relative(0.1);
    assert!(says(&Fixed::new(a.view(), other, noise), "operator has 6 columns; the method was built for 5"));
    for bad in [Noise::Relative(0.0), Noise::Absolute(f64::NAN)] {
        assert!(Fixed::new(a.view(), Arc::clone(&prior), bad).is_err(), "{bad:?}");
    }
    let fixed = Fixed::new(a.view(), prior, noise).unwrap();
    let mut window = fixed.window();
    window.extend(&y[..3]);
    assert!(says(&window.image(), "operator has 4 rows but `y` has 3 entries"));
    window.push(f64::NAN);
    assert!(says(&window.image(), "`y[3]`"));
    assert!(says(&window.non_negative(), "`y[3]`"));
    window.clear();
    window.extend(&y);
    assert!(window.non_negative().is_ok());
}
