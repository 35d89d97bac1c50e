//! An image followed in time against the posterior of all its windows at once, by dense algebra.

use allocation_counter::measure;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::Matrix;
use spts_recon::recover::{Gaussian, Motion, SequentialError, TrackedImage};
use std::sync::Arc;

const MOTION: Motion = Motion {
    memory: 30.0,
    strength_memory: 12.0,
    noise: 0.2,
    idle_noise: 0.1,
};

/// A window: time since the one before it, rows and samples.
type Drawn = (f64, Matrix, Vec<f64>);

fn prior(rng: &mut ChaCha8Rng, n: usize) -> Arc<Gaussian> {
    let root = DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
    let covariance = &root * root.transpose() / n as f64 + 0.05 * DMatrix::identity(n, n);
    Arc::new(Gaussian::new(vec![0.0; n], Matrix::from(&covariance)).unwrap())
}

fn rows(rng: &mut ChaCha8Rng, m: usize, n: usize) -> Matrix {
    let signs = (0..m * n).map(|_| if rng.random() { 1.0 } else { -1.0 });
    Matrix::from_rows(m, n, signs.collect()).unwrap()
}

fn windows(rng: &mut ChaCha8Rng, n: usize) -> Vec<Drawn> {
    let sizes = [(0.0, 3), (2.0, 1), (40.0, 5), (0.5, 2), (7.0, 4)];
    let each = sizes.map(|(elapsed, m)| {
        let phi = rows(rng, m, n);
        (elapsed, phi, (0..m).map(|_| rng.random_range(-3.0..3.0)).collect())
    });
    each.to_vec()
}

fn run(prior: &Arc<Gaussian>, motion: Motion, windows: &[Drawn]) -> TrackedImage {
    let mut image = TrackedImage::new(Arc::clone(prior), motion).unwrap();
    for (elapsed, phi, y) in windows {
        image.observe(*elapsed, phi.view(), y).unwrap();
    }
    image
}

/// The shapes at all windows are one Gaussian with covariances exp(−|tᵢ − tⱼ|/τ) C, and the samples are linear in them:
/// the filter has the mean and the covariance of the last shape given all samples. Systems of 15 samples with a
/// condition below 1e4 lose four of sixteen digits; 1e-10 leaves two more.
#[test]
fn the_filter_is_the_posterior_of_all_windows() {
    let (n, mut rng) = (6, ChaCha8Rng::seed_from_u64(3));
    let prior = prior(&mut rng, n);
    let windows = windows(&mut rng, n);
    let c = DMatrix::from_row_slice(n, n, prior.covariance().view().values());
    let mut now = 0.0;
    let mut times = Vec::new();
    for (elapsed, ..) in &windows {
        now += elapsed;
        times.push(now);
    }
    // strength and noise after every window, from the definition
    let unit = n as f64 * c.trace() / n as f64;
    let strength = |k: usize| {
        let age = |i: usize| (-(times[k] - times[i]) / MOTION.strength_memory).exp();
        let count: f64 = (0..=k).map(|i| age(i) * windows[i].2.len() as f64).sum();
        let squares: f64 = (0..=k)
            .map(|i| age(i) * windows[i].2.iter().map(|y| y * y).sum::<f64>())
            .sum();
        let (mean, idle) = (squares / count, MOTION.idle_noise.powi(2));
        (((mean - idle) / unit).sqrt(), MOTION.noise.powi(2) * mean + idle)
    };
    let total: usize = windows.iter().map(|w| w.2.len()).sum();
    let last = windows.len() - 1;
    let (mut gram, mut cross) = (DMatrix::zeros(total, total), DMatrix::zeros(n, total));
    let mut y = DVector::zeros(total);
    let (mut top, correlation) = (0, |i: usize, j: usize| {
        (-(times[i] - times[j]).abs() / MOTION.memory).exp()
    });
    for i in 0..=last {
        let (a, (s, noise)) = (&windows[i].1, strength(i));
        let a = DMatrix::from_row_slice(a.nrows(), n, a.view().values()) * s;
        let mut left = 0;
        for (j, (_, b, _)) in windows.iter().enumerate() {
            let b = DMatrix::from_row_slice(b.nrows(), n, b.view().values()) * strength(j).0;
            let block = &a * &c * b.transpose() * correlation(i, j);
            gram.view_mut((top, left), block.shape()).copy_from(&block);
            left += b.nrows();
        }
        for k in 0..a.nrows() {
            gram[(top + k, top + k)] += noise;
            y[top + k] = windows[i].2[k];
        }
        cross
            .view_mut((0, top), (n, a.nrows()))
            .copy_from(&(&c * a.transpose() * correlation(i, last)));
        top += a.nrows();
    }
    let inverse = gram.try_inverse().unwrap();
    let mean = &cross * &inverse * y * strength(last).0;
    let covariance = &c - &cross * inverse * cross.transpose();
    let image = run(&prior, MOTION, &windows);
    for (found, expected) in image.image().iter().zip(mean.iter()) {
        assert!(
            (found - expected).abs() < 1e-10 * mean.amax(),
            "{found}, expected {expected}"
        );
    }
    for (found, expected) in image.covariance().iter().zip(covariance.iter()) {
        assert!(
            (found - expected).abs() < 1e-10 * c.amax(),
            "{found}, expected {expected}"
        );
    }
}

/// An image in another unit is the same image: by powers of two, to the bit, as far as squares of samples reach.
#[test]
fn the_unit_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let prior = prior(&mut rng, 9);
    let drawn = windows(&mut rng, 9);
    let one = run(&prior, MOTION, &drawn);
    for exponent in [-300, -20, 20, 300] {
        let unit = 2.0_f64.powi(exponent);
        let motion = Motion {
            idle_noise: MOTION.idle_noise * unit,
            ..MOTION
        };
        let scaled = drawn.iter().cloned();
        let scaled: Vec<Drawn> = scaled
            .map(|(t, phi, y)| (t, phi, y.iter().map(|y| y * unit).collect()))
            .collect();
        let other = run(&prior, motion, &scaled);
        for (a, b) in one.image().iter().zip(other.image()) {
            assert_eq!((a * unit).to_bits(), b.to_bits(), "2^{exponent}");
        }
    }
    // squares that are lost count as no output
    let silent = run(
        &prior,
        Motion {
            idle_noise: 0.0,
            ..MOTION
        },
        &[(1.0, rows(&mut rng, 2, 9), vec![1e-300; 2])],
    );
    assert!(silent.image().iter().all(|x| x.to_bits() == 0) && silent.strength().to_bits() == 0);
    assert!(silent.expected_iou(0.23).to_bits() == 0);
}

/// After a long time without a contact nothing is left of the one before.
#[test]
fn idle_time_forgets() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let prior = prior(&mut rng, 9);
    let mut image = run(&prior, MOTION, &windows(&mut rng, 9));
    let before = image.covariance()[0];
    for _ in 0..60 {
        let y: Vec<f64> = (0..5).map(|_| rng.random_range(-0.1..0.1)).collect();
        image.observe(5.0, rows(&mut rng, 5, 9).view(), &y).unwrap();
    }
    let c = prior.covariance().row(0)[0];
    // 300 are ten times the memory; noise of √50 times the output leaves a fifth less variance at most
    assert!(
        image.covariance()[0] > 0.8 * c && before < 0.5 * c,
        "{before}, {}",
        image.covariance()[0]
    );
    image.clear();
    assert_eq!(image.covariance(), prior.covariance().view().values());
    assert!(image.image().iter().all(|x| x.to_bits() == 0));
}

/// What cannot be used is refused, and leaves the image as it was.
#[test]
fn what_cannot_be_used_is_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let prior = prior(&mut rng, 4);
    let mut image = run(&prior, MOTION, &windows(&mut rng, 4));
    let before = image.clone();
    let phi = rows(&mut rng, 2, 4);
    for bad in [f64::NAN, f64::INFINITY, 1e300, -1e300] {
        let refused = image.observe(1.0, phi.view(), &[1.0, bad]);
        assert!(matches!(refused, Err(SequentialError::Range(_))), "{bad}");
        let weights = Matrix::from_rows(1, 4, vec![1.0, bad, 1.0, 1.0]).unwrap();
        let refused = image.observe(1.0, weights.view(), &[1.0]);
        assert!(matches!(refused, Err(SequentialError::Range(_))), "{bad}");
    }
    for elapsed in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(image.observe(elapsed, phi.view(), &[1.0; 2]).is_err(), "{elapsed}");
    }
    assert!(matches!(
        image.observe(1.0, phi.view(), &[1.0]),
        Err(SequentialError::NotPrepared { index: 1, prepared: 2 })
    ));
    let wide = rows(&mut rng, 2, 5);
    assert!(matches!(
        image.observe(1.0, wide.view(), &[1.0; 2]),
        Err(SequentialError::Columns { cols: 5, expected: 4 })
    ));
    assert_eq!(
        (image.image(), image.covariance()),
        (before.image(), before.covariance())
    );
    // the longest time there is, and the largest samples
    image.observe(f64::MAX, phi.view(), &[1e100, -1e100]).unwrap();
    assert!(image.image().iter().chain(image.covariance()).all(|v| v.is_finite()));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for motion in [
            Motion { memory: bad, ..MOTION },
            Motion {
                strength_memory: bad,
                ..MOTION
            },
            Motion { noise: bad, ..MOTION },
        ] {
            assert!(TrackedImage::new(Arc::clone(&prior), motion).is_err(), "{motion:?}");
        }
    }
    let identity = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
    let mean = Gaussian::new(vec![0.0, 1.0], identity).unwrap();
    assert!(matches!(
        TrackedImage::new(Arc::new(mean), MOTION),
        Err(SequentialError::Mean { index: 1, .. })
    ));
}

/// A window allocates nothing.
#[test]
fn windows_allocate_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let prior = prior(&mut rng, 36);
    let mut image = TrackedImage::new(prior, MOTION).unwrap();
    let phi = rows(&mut rng, 20, 36);
    let y = vec![0.7; 20];
    let allocated = measure(|| image.observe(20.0, phi.view(), &y).unwrap());
    assert_eq!(allocated.count_total, 0);
}
