//! Estimates for one sensing matrix against those that are given it with every window, which scipy has checked.

use nalgebra::DMatrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{Fixed, FixedError, Gaussian, Lmmse, NnLmmse, Noise};
use spts_recon::{Matrix, Problem, Recover, RecoverError, Solution, Workspace};
use std::sync::Arc;

/// A prior, an operator and measurements of an image with zeros.
fn problem(seed: u64, m: usize, n: usize, mean: f64) -> (Arc<Gaussian>, Matrix, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let root = DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
    let covariance = &root * root.transpose() / n as f64 + 0.05 * DMatrix::identity(n, n);
    let prior = Gaussian::new(vec![mean; n], Matrix::from(&covariance)).unwrap();
    let a = DMatrix::from_fn(m, n, |_, _| if rng.random() { 1.0 } else { -1.0 });
    let image: Vec<f64> = (0..n)
        .map(|k| if k % 3 == 0 { rng.random_range(0.5..2.0) } else { 0.0 })
        .collect();
    let a = Matrix::from(&a);
    let sum = |r: usize| a.row(r).iter().zip(&image).map(|(w, x)| w * x).sum::<f64>();
    let y = (0..m).map(|r| sum(r) + rng.random_range(-0.1..0.1)).collect();
    (Arc::new(prior), a, y)
}

fn by(method: &dyn Recover, a: &Matrix, y: &[f64]) -> Vec<f64> {
    let (mut work, mut solution) = (Workspace::default(), Solution::default());
    let problem = Problem::new(a.view(), y).unwrap();
    method.recover_into(&problem, &mut work, &mut solution).unwrap();
    let mut image = vec![0.0; a.ncols()];
    solution
        .support
        .iter()
        .zip(&solution.coefficients)
        .for_each(|(k, v)| image[*k] = *v);
    image
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let largest = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() <= tolerance * largest,
            "{what}, pixel {k}: {found} against {expected}"
        );
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
            let (prior, a, y) = problem(m as u64, m, n, mean);
            let fixed = Fixed::new(a.view(), Arc::clone(&prior), noise).unwrap();
            assert_eq!((fixed.measurements(), fixed.pixels()), (m, n));
            let linear = by(&Lmmse::new(Arc::clone(&prior), noise).unwrap(), &a, &y);
            let non_negative = by(&NnLmmse::new(prior, noise).unwrap(), &a, &y);
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
                let (prior, a, y) = problem(3, 10, 24, 0.0);
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
                    let expected = by(&NnLmmse::new(prior, noise).unwrap(), &a, &y);
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
    let (prior, a, y) = problem(5, 4, 6, 0.0);
    let other = Arc::new(Gaussian::white(5, 1.0).unwrap());
    let noise = Noise::Relative(0.1);
    assert!(matches!(
        Fixed::new(a.view(), other, noise),
        Err(FixedError::Operator(RecoverError::Columns { cols: 6, expected: 5 }))
    ));
    for bad in [Noise::Relative(0.0), Noise::Absolute(f64::NAN)] {
        assert!(Fixed::new(a.view(), Arc::clone(&prior), bad).is_err(), "{bad:?}");
    }
    let fixed = Fixed::new(a.view(), prior, noise).unwrap();
    let mut window = fixed.window();
    window.extend(&y[..3]);
    assert_eq!(window.image(), Err(RecoverError::ShapeMismatch { rows: 4, len: 3 }));
    window.push(f64::NAN);
    assert!(matches!(window.image(), Err(RecoverError::NotFinite { index: 3, .. })));
    assert!(matches!(
        window.non_negative(),
        Err(RecoverError::NotFinite { index: 3, .. })
    ));
    window.clear();
    window.extend(&y);
    assert!(window.non_negative().is_ok());
}
