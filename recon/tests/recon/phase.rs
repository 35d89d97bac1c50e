//! Every method recovers planted signals where theory says that its kind does.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{Build, NnLasso, Penalty, RECOVER};
use spts_recon::{Matrix, Problem, Workspace};

/// Unknowns, measurements: δ = 0.5.
const K: usize = 200;
const M: usize = 100;

/// Share of 40 problems whose planted signal is found to 1e-2 of its length: ±1 weights, S magnitudes in [0.5, 1.5],
/// positive or of either sign. Weak thresholds, above which ℓ1 minimisation fails: ρ = 0.385 for coefficients of either
/// sign, 0.558 for positive ones that are known to be. D. L. Donoho, J. Tanner, Phil. Trans. R. Soc. A 367 (2009) 4273.
/// At a finite K the transition is about K^(−1/2) = 0.07 wide on either side.
fn rate(build: Build, sparsity: usize, positive: bool) -> f64 {
    let mut work = Workspace::default();
    let trials = 40;
    let found = (0..trials).filter(|&trial| {
        let mut rng = ChaCha8Rng::seed_from_u64(trial);
        let weights = (0..M * K).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let a = Matrix::from_rows(M, K, weights).unwrap();
        let mut x = vec![0.0; K];
        for place in rand::seq::index::sample(&mut rng, K, sparsity) {
            let magnitude = rng.random_range(0.5..1.5);
            x[place] = if positive || rng.random() {
                magnitude
            } else {
                -magnitude
            };
        }
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let y: Vec<f64> = (0..M)
            .map(|r| a.row(r).iter().zip(&x).map(|(a, x)| a * x).sum())
            .collect();
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

/// Pursuits recover from M ≈ 2 S ln K measurements (J. A. Tropp, A. C. Gilbert, IEEE Trans. Inf. Theory 53 (2007)
/// 4655): S = 9 of 100, ρ = 0.09.
#[test]
fn pursuits_recover_from_2_s_ln_k_measurements() {
    for (name, build) in RECOVER {
        for positive in [false, true] {
            if positive || *name != "nn_omp" {
                let rate = rate(*build, 9, positive);
                assert!(rate >= 0.95, "{name}, positive {positive}: {rate}");
            }
        }
    }
}
