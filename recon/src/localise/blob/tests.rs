//! Blobs against their definition, and on planted contacts.

use super::*;
use crate::localise::distance;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

fn signs(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect()
}

fn blob(rows: usize, cols: usize, centre: [f64; 2], width: f64) -> Vec<f64> {
    (0..rows * cols)
        .map(|i| {
            let d = distance([(i / cols) as f64, (i % cols) as f64], centre);
            (-d * d / (2.0 * width * width)).exp()
        })
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[test]
fn projection_is_the_product_with_the_blobs() {
    let config = BlobConfig {
        step_px: 0.5,
        widths_px: vec![0.6, 1.1],
        ..BlobConfig::new(4, 7)
    };
    let localiser = Localiser::new(&config).unwrap();
    assert_eq!(localiser.templates(), 2 * 7 * 13);
    let weights = signs(&mut ChaCha8Rng::seed_from_u64(1), 28);
    let mut projected = Vec::new();
    localiser.project(&weights, &mut projected).unwrap();
    let mut k = 0;
    for width in [0.6, 1.1] {
        for r in 0..7 {
            for c in 0..13 {
                let b = blob(4, 7, [f64::from(r) * 0.5, f64::from(c) * 0.5], width);
                // 28 products of numbers below 1
                assert!((projected[k] - dot(&weights, &b)).abs() < 28.0 * 8.0 * f64::EPSILON);
                assert!((localiser.variances[k] - 0.35_f64.powi(2) * dot(&b, &b)).abs() < 1e-13);
                k += 1;
            }
        }
    }
}

/// Planted blobs between the grid's centres are found, and the stated covariance is the error's: the mean squared
/// Mahalanobis distance of a two-dimensional Gaussian is 2.
#[test]
fn finds_planted_blobs_and_knows_how_well() {
    let localiser = Localiser::new(&BlobConfig::new(10, 10)).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut projected = Vec::new();
    let (trials, mut mahalanobis) = (200, 0.0);
    for _ in 0..trials {
        let centre = [rng.random_range(1.5..7.5), rng.random_range(1.5..7.5)];
        let image = blob(10, 10, centre, 0.9);
        let sd = 0.35 * dot(&image, &image).sqrt();
        let mut evidence = localiser.evidence();
        for _ in 0..40 {
            let weights = signs(&mut rng, 100);
            // twelve uniform numbers less 6: mean 0, variance 1
            let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            localiser.project(&weights, &mut projected).unwrap();
            evidence
                .observe(&projected, 1.7 * (dot(&weights, &image) + sd * normal))
                .unwrap();
        }
        let e = localiser.estimate(&mut evidence);
        assert!(distance(e.position_px, centre) < 0.5, "{e:?} for {centre:?}");
        // a width one step off changes the amplitude by up to (.9/.7)² at the same volume, noise some 10 % more
        assert!((0.9..3.2).contains(&e.amplitude), "{e:?}");
        let [[a, b], [_, c]] = e.covariance_px2;
        let d = [e.position_px[0] - centre[0], e.position_px[1] - centre[1]];
        mahalanobis += (c * d[0] * d[0] - 2.0 * b * d[0] * d[1] + a * d[1] * d[1]) / (a * c - b * b);
    }
    // 200 draws have a mean of 2 ± .14 if the posterior were a Gaussian; the cells of the grid are as wide as it, which
    // may change either's variance by half
    let mean = mahalanobis / f64::from(trials);
    assert!((1.0..4.0).contains(&mean), "{mean}");
}

#[test]
fn evidence_does_not_depend_on_the_unit_of_y() {
    let localiser = Localiser::new(&BlobConfig {
        step_px: 0.5,
        ..BlobConfig::new(6, 6)
    })
    .unwrap();
    let estimate = |unit: f64| {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
        for _ in 0..12 {
            localiser.project(&signs(&mut rng, 36), &mut projected).unwrap();
            evidence
                .observe(&projected, unit * rng.random_range(-1.0..1.0))
                .unwrap();
        }
        localiser.estimate(&mut evidence)
    };
    let one = estimate(1.0);
    for unit in [1e-60, 1e-6, 1e70] {
        let other = estimate(unit);
        assert!(
            distance(one.position_px, other.position_px) < 1e-9,
            "{unit}: {other:?}, {one:?}"
        );
        assert!((other.amplitude / unit / one.amplitude - 1.0).abs() < 1e-9);
    }
}

#[test]
fn nothing_measured_is_the_whole_sheet() {
    let localiser = Localiser::new(&BlobConfig::new(9, 5)).unwrap();
    let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
    for y in [None, Some(0.0), Some(1e-300)] {
        if let Some(y) = y {
            localiser.project(&[1.0; 45], &mut projected).unwrap();
            evidence.observe(&projected, y).unwrap();
        }
        let e = localiser.estimate(&mut evidence);
        // n cells of a quarter of a taxel, spread evenly: n²/12 of their squares, for 33 and 17 of them
        assert!(distance(e.position_px, [4.0, 2.0]) < 1e-12, "{e:?}");
        assert!((e.covariance_px2[0][0] - 33.0 * 33.0 / 192.0).abs() < 1e-9, "{e:?}");
        assert!((e.covariance_px2[1][1] - 17.0 * 17.0 / 192.0).abs() < 1e-9, "{e:?}");
        assert!(e.amplitude.abs() < 1e-300);
    }
    evidence.observe(&projected, 1e79).unwrap();
    assert!(localiser.estimate(&mut evidence).position_px[0].is_finite());
}

#[test]
fn refuses_what_it_cannot_use() {
    let good = BlobConfig::new(4, 4);
    for bad in [
        BlobConfig {
            rows: 0,
            ..good.clone()
        },
        BlobConfig {
            step_px: 0.0,
            ..good.clone()
        },
        BlobConfig {
            noise: f64::NAN,
            ..good.clone()
        },
        BlobConfig {
            widths_px: vec![],
            ..good.clone()
        },
        BlobConfig {
            widths_px: vec![0.0],
            ..good.clone()
        },
    ] {
        assert!(Localiser::new(&bad).is_err(), "{bad:?}");
    }
    let localiser = Localiser::new(&good).unwrap();
    let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
    assert!(localiser.project(&[1.0; 15], &mut projected).is_err());
    assert!(localiser.project(&[f64::NAN; 16], &mut projected).is_err());
    localiser.project(&[1.0; 16], &mut projected).unwrap();
    let before = evidence.clone();
    for y in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(evidence.observe(&projected, y).is_err());
    }
    assert!(evidence.observe(&projected[1..], 1.0).is_err());
    assert_eq!(evidence, before);
}
