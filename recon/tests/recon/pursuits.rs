//! Pursuits against scikit-learn (`scripts/oracles/pursuits.py` wrote its supports of 1,000 random problems), against
//! their definitions, and against the theory of sparse recovery.

use crate::helpers::signs;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{Build, NnLasso, NnOmp, Omp, Penalty, ReferenceOmp};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};

/// (M, K, S), and the share of noise, as in `scripts/oracles/problems.py`.
const SHAPES: [(usize, usize, usize); 7] =
    [(10, 40, 3), (25, 100, 6), (50, 100, 20), (7, 100, 2), (20, 100, 5), (13, 60, 4), (40, 24, 8)];
const NOISE: f64 = 0.1;

/// SplitMix64: numbers in [-1, 1) from the top 53 bits.
fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / 2.0_f64.powi(52) - 1.0
        })
        .collect()
}

/// (A, y, S) number `index`.
fn problem(index: usize) -> (Matrix, Vec<f64>, usize) {
    let (m, k, s) = SHAPES[index % SHAPES.len()];
    let values = uniform(1_000_003 * index as u64, m * k + m + k);
    let (matrix, rest) = values.split_at(m * k);
    let (noise, draws) = rest.split_at(m);
    let a = Matrix::from_rows(m, k, matrix.to_vec()).unwrap();
    if index.is_multiple_of(2) {
        return (a, noise.to_vec(), s);
    }
    let mut order: Vec<usize> = (0..k).collect();
    order.sort_by(|&i, &j| draws[j].abs().total_cmp(&draws[i].abs()));
    let mut y: Vec<f64> = noise.iter().map(|v| NOISE * v).collect();
    for (r, y) in y.iter_mut().enumerate() {
        *y += order[..s].iter().map(|&c| a.row(r)[c] * draws[c]).sum::<f64>();
    }
    (a, y, s)
}

/// Supports of one program, by problem.
fn oracle(program: &str) -> Vec<Vec<usize>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/oracles/pursuits.json");
    let text = std::fs::read_to_string(path).unwrap();
    let values: serde_json::Value = serde_json::from_str(&text).unwrap();
    let supports: Vec<Vec<usize>> = serde_json::from_value(values[program].clone()).unwrap();
    assert_eq!(supports.len(), 1000, "{program}");
    supports
}

fn sorted(solution: &Solution) -> Vec<usize> {
    let mut support = solution.support.clone();
    support.sort_unstable();
    support
}

fn assert_supports(program: &str, build: impl Fn(usize) -> Box<dyn Recover>) {
    let mut work = Workspace::default();
    for (index, expected) in oracle(program).iter().enumerate() {
        let (a, y, s) = problem(index);
        let problem = Problem::new(a.view(), &y).unwrap();
        let solution = build(s).recover(&problem, &mut work).unwrap();
        assert_eq!(&sorted(&solution), expected, "{program}: problem {index}");
    }
}

#[test]
fn omp_finds_the_supports_of_scikit_learn() {
    assert_supports("omp_normalized", |s| Box::new(Omp::new(s)));
    assert_supports("omp", |s| Box::new(ReferenceOmp::new(s)));
}

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
        let subset: Vec<usize> = (0..support.len()).filter(|i| mask >> i & 1 == 1).map(|i| support[i]).collect();
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
    assert!(dropped > 0, "no problem made an atom leave: the test does not test that");
}

/// Share of 40 problems whose planted signal is found to 1e-2 of its length: ±1 weights, S magnitudes in [0.5, 1.5],
/// positive or of either sign. Weak thresholds, above which ℓ1 minimisation fails: ρ = 0.385 for coefficients of either
/// sign, 0.558 for positive ones that are known to be. D. L. Donoho, J. Tanner, Phil. Trans. R. Soc. A 367 (2009) 4273.
/// At a finite K the transition is about K^(−1/2) = 0.07 wide on either side.
fn rate(build: Build, sparsity: usize, positive: bool) -> f64 {
    // δ = 0.5
    const K: usize = 200;
    const M: usize = 100;
    let mut work = Workspace::default();
    let trials = 40;
    let found = (0..trials).filter(|&trial| {
        let mut rng = ChaCha8Rng::seed_from_u64(trial);
        let a = signs(&mut rng, M, K);
        let mut x = vec![0.0; K];
        for place in rand::seq::index::sample(&mut rng, K, sparsity) {
            let magnitude = rng.random_range(0.5..1.5);
            x[place] = if positive || rng.random() { magnitude } else { -magnitude };
        }
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let y: Vec<f64> = (0..M).map(|r| a.row(r).iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
        let mut error = x.clone();
        if let Ok(solution) = build(sparsity).recover(&Problem::new(a.view(), &y).unwrap(), &mut work) {
            for (&k, c) in solution.support.iter().zip(&solution.coefficients) {
                error[k] -= c;
            }
        }
        square(&error) <= 1e-4 * square(&x)
    });
    found.count() as f64 / trials as f64
}

const NN_LASSO: Build = |_| Box::new(NnLasso::new(Penalty::Relative(1e-4)).unwrap());

/// Lasso with a penalty that hardly biases is basis pursuit; its non-negative form is the one with the higher
/// threshold.
#[test]
fn the_non_negative_lasso_recovers_below_its_threshold_only() {
    let below = rate(NN_LASSO, 45, true);
    assert!(below >= 0.9, "ρ = 0.45: {below}");
    let above = rate(NN_LASSO, 70, true);
    assert!(above <= 0.1, "ρ = 0.7: {above}");
}
