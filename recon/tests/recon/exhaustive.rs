//! Tiny problems against the definitions, every support tried with nalgebra.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{NnOmp, Omp};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};

const M: usize = 6;
const K: usize = 9;

fn draw(rng: &mut ChaCha8Rng) -> (DMatrix<f64>, DVector<f64>) {
    (
        DMatrix::from_fn(M, K, |_, _| rng.random_range(-1.0..1.0)),
        DVector::from_fn(M, |_, _| rng.random_range(-1.0..1.0)),
    )
}

fn recover(algorithm: &dyn Recover, a: &DMatrix<f64>, y: &DVector<f64>) -> Solution {
    let dense = Matrix::from(a);
    let problem = Problem::new(dense.view(), y.as_slice()).unwrap();
    algorithm.recover(&problem, &mut Workspace::default()).unwrap()
}

/// Least squares on `support`: coefficients and residual.
fn fit(a: &DMatrix<f64>, y: &DVector<f64>, support: &[usize]) -> (DVector<f64>, DVector<f64>) {
    if support.is_empty() {
        return (DVector::zeros(0), y.clone());
    }
    let sub = a.select_columns(support);
    let alpha = sub.clone().pseudo_inverse(1e-13).unwrap() * y;
    let residual = y - sub * &alpha;
    (alpha, residual)
}

/// Best non-negative least squares within `support`: the smallest residual of all its subsets whose fit is positive.
fn non_negative(a: &DMatrix<f64>, y: &DVector<f64>, support: &[usize]) -> (f64, Vec<usize>) {
    let mut best = (y.norm(), Vec::new());
    for mask in 1_usize..1 << support.len() {
        let subset: Vec<usize> = (0..support.len())
            .filter(|i| mask >> i & 1 == 1)
            .map(|i| support[i])
            .collect();
        let (alpha, residual) = fit(a, y, &subset);
        if alpha.iter().all(|c| *c > 0.0) && residual.norm() < best.0 {
            best = (residual.norm(), subset);
        }
    }
    best
}

fn assert_fit(name: &str, a: &DMatrix<f64>, y: &DVector<f64>, got: &Solution) {
    let (alpha, residual) = fit(a, y, &got.support);
    for (g, e) in got.coefficients.iter().zip(alpha.iter()) {
        // least squares of condition below 1e4 twice over: 1e4·ε with a margin of 1000
        assert!((g - e).abs() <= 1e-9 * e.abs().max(1.0), "{name}: {g}, expected {e}");
    }
    assert!((got.residual_norm - residual.norm()).abs() <= 1e-9, "{name}");
}

#[test]
fn every_choice_of_omp_is_the_best_of_all_atoms() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for _ in 0..200 {
        let (a, y) = draw(&mut rng);
        for s in 1..=4 {
            let omp = recover(&Omp::new(s), &a, &y);
            assert_eq!(omp.support.len(), s);
            for n in 0..s {
                let (_, residual) = fit(&a, &y, &omp.support[..n]);
                let score = |k: usize| a.column(k).dot(&residual).abs() / a.column(k).norm();
                let best = (0..K).max_by(|i, j| score(*i).total_cmp(&score(*j)));
                assert_eq!(best, Some(omp.support[n]), "choice {n}");
            }
            assert_fit("omp", &a, &y, &omp);
        }
    }
}

#[test]
fn nn_omp_solves_the_non_negative_least_squares_of_each_choice() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut dropped = 0;
    for _ in 0..300 {
        let (a, y) = draw(&mut rng);
        // the pursuit by its definition, with exhaustive least squares
        let mut support: Vec<usize> = Vec::new();
        for _ in 0..40 {
            let (_, residual) = fit(&a, &y, &support);
            let score = |k: usize| a.column(k).dot(&residual) / a.column(k).norm();
            let others = (0..K).filter(|k| !support.contains(k) && score(*k) > 1e-12);
            let Some(atom) = others.max_by(|i, j| score(*i).total_cmp(&score(*j))) else {
                break;
            };
            let mut trial = support.clone();
            trial.push(atom);
            dropped += trial.len();
            support = non_negative(&a, &y, &trial).1;
            dropped -= support.len();
            if support.len() == 4 {
                break;
            }
        }
        let got = recover(&NnOmp::new(4), &a, &y);
        let mut found = got.support.clone();
        found.sort_unstable();
        support.sort_unstable();
        assert_eq!(found, support);
        assert!(got.coefficients.iter().all(|c| *c > 0.0), "{:?}", got.coefficients);
        assert_fit("nn_omp", &a, &y, &got);
    }
    assert!(
        dropped > 0,
        "no problem made an atom leave: the test does not test that"
    );
}
