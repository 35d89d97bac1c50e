//! Every method recovers planted signals where theory says that its kind does.

use spts_recon::recover::{Build, NnLasso, Noise, Penalty, PhasePoint, RECOVER, Sbl, Signs};

/// δ = 0.5 at K = 200. Weak thresholds there, above which ℓ1 minimisation fails: ρ = 0.385 for coefficients of either
/// sign, 0.558 for positive ones that are known to be. D. L. Donoho, J. Tanner, Phil. Trans. R. Soc. A 367 (2009) 4273.
/// At a finite K the transition is about K^(−1/2) = 0.07 wide on either side.
fn rate(build: Build, rho: f64, signs: Signs) -> f64 {
    let point = PhasePoint {
        n_atoms: 200,
        delta: 0.5,
        rho,
        signs,
        trials: 40,
        seed: 5,
    };
    let (_, sparsity) = point.shape();
    point.recovery_rate(build(sparsity).as_ref())
}

const NN_LASSO: Build = |_| Box::new(NnLasso::new(Penalty::Relative(1e-4)).unwrap());
const SBL: Build = |_| Box::new(Sbl::new(Noise::Relative(1e-4)).unwrap());

/// Lasso with a penalty that hardly biases is basis pursuit; its non-negative form is the one with the higher
/// threshold.
#[test]
fn the_non_negative_lasso_recovers_below_its_threshold_only() {
    let below = rate(NN_LASSO, 0.45, Signs::Positive);
    assert!(below >= 0.9, "ρ = 0.45: {below}");
    let above = rate(NN_LASSO, 0.7, Signs::Positive);
    assert!(above <= 0.1, "ρ = 0.7: {above}");
}

/// Pursuits recover from M ≈ 2 S ln K measurements (J. A. Tropp, A. C. Gilbert, IEEE Trans. Inf. Theory 53 (2007)
/// 4655): S = 9 of 100, ρ = 0.09. Sparse Bayesian learning that takes in one atom at a time is one of them.
#[test]
fn pursuits_recover_from_2_s_ln_k_measurements() {
    for (name, build) in RECOVER.iter().chain(&[("sbl", SBL)]) {
        for signs in [Signs::Either, Signs::Positive] {
            if *name == "nn_omp" && signs == Signs::Either {
                continue;
            }
            let rate = rate(*build, 0.09, signs);
            assert!(rate >= 0.95, "{name}, {signs:?}: {rate}");
        }
    }
}
