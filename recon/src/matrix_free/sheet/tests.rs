//! Tests of both estimates.

use super::{SheetDecoder, SheetNoise, SheetPrior};
use crate::kernels::dot;
use crate::matrix::Matrix;
use nalgebra::{DMatrix, DVector};

fn signs(rows: usize, taxels: usize) -> Vec<f64> {
    let sign = |k: u64| {
        if (k * k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 1 {
            1.0
        } else {
            -1.0
        }
    };
    (1..=(rows * taxels) as u64).map(sign).collect()
}

fn decoder(rows: usize, wires: &[usize]) -> SheetDecoder {
    let prior = SheetPrior::smooth([5, 6], 1.2).unwrap();
    let count = wires.iter().max().unwrap() + 1;
    let mut decoder = SheetDecoder::new(prior, SheetNoise::default(), count).unwrap();
    let phi = signs(rows, 30);
    // in two parts
    decoder.extend(&phi[..7 * 30], &wires[..7]).unwrap();
    decoder.extend(&phi[7 * 30..], &wires[7..]).unwrap();
    decoder
}

/// Against the formula with dense matrices, for all rows and for the first of them, on one wire and on two.
#[test]
fn the_linear_estimate_is_the_formula() {
    for wires in [vec![0; 20], (0..20).map(|i| i % 2).collect::<Vec<_>>()] {
        let decoder = decoder(20, &wires);
        let c = DMatrix::from_fn(30, 30, |i, j| decoder.prior.covariance(i, j));
        for m in [20, 9] {
            let phi = DMatrix::from_row_slice(m, 30, &decoder.rows[..m * 30]);
            let square = 30.0 / if wires[1] == 1 { 2.0 } else { 1.0 };
            let noise = DMatrix::from_fn(m, m, |i, j| {
                square * (if i == j { 0.01 } else { 0.0 } + if wires[i] == wires[j] { 0.25 } else { 0.0 })
            });
            let y: Vec<f64> = (0..m).map(|i| (i as f64 * 1.7).sin()).collect();
            let system = &phi * &c * phi.transpose() + noise;
            let expected = &c * phi.transpose() * system.try_inverse().unwrap() * DVector::from_vec(y.clone());
            let found = decoder.linear(&y).unwrap();
            for (found, expected) in found.iter().zip(expected.iter()) {
                assert!((found - expected).abs() < 1e-10, "{found} {expected}");
            }
        }
    }
}

/// Where the linear estimate is not negative, both are the same; and an offset of a wire changes hardly anything.
#[test]
fn the_non_negative_estimate_goes_with_the_linear_one() {
    let decoder = decoder(24, &[0; 24]);
    let truth: Vec<f64> = (0..30).map(|k| if (13..16).contains(&k) { 2.0 } else { 0.0 }).collect();
    let phi = Matrix::from_rows(24, 30, decoder.rows.clone()).unwrap();
    let y: Vec<f64> = (0..24).map(|i| dot(phi.row(i), &truth)).collect();
    let image = decoder.non_negative(&y, 30).unwrap();
    let strongest = (0..30).max_by(|a, b| image[*a].total_cmp(&image[*b])).unwrap();
    assert!((13..16).contains(&strongest) && image.iter().all(|v| *v >= 0.0));
    let shifted: Vec<f64> = y.iter().map(|v| v + 3.0).collect();
    let other = decoder.non_negative(&shifted, 30).unwrap();
    let far = image
        .iter()
        .zip(&other)
        .fold(0.0_f64, |far, (a, b)| far.max((a - b).abs()));
    assert!(far < 0.3, "{far}");
    // fewer places than taxels
    let few = decoder.non_negative(&y, 5).unwrap();
    assert!(few.iter().filter(|v| **v > 0.0).count() <= 5);
    assert!(decoder.non_negative(&[0.0; 24], 30).unwrap().iter().all(|v| *v == 0.0));
}

#[test]
fn what_does_not_fit_is_refused() {
    let prior = SheetPrior::smooth([2, 2], 1.0).unwrap();
    let noise = SheetNoise {
        own: f64::NAN,
        common: 0.0,
    };
    assert!(SheetDecoder::new(prior.clone(), noise, 1).is_err());
    let mut decoder = SheetDecoder::new(prior, SheetNoise::default(), 1).unwrap();
    assert!(decoder.extend(&[1.0; 5], &[0]).is_err() && decoder.extend(&[f64::NAN; 4], &[0]).is_err());
    decoder.extend(&[1.0; 4], &[0]).unwrap();
    assert!(decoder.linear(&[1.0, 2.0]).is_err() && decoder.linear(&[]).is_err());
    assert!(decoder.linear(&[f64::INFINITY]).is_err());
}
