//! The regularised algorithms against closed forms and against scikit-learn and scipy (`scripts/oracles/convex.py`).

use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use spts_recon::recover::{Fixed, Gaussian, Lmmse, NnLasso, NnLmmse, Noise, Penalty, Tv};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};
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

fn solve(method: &dyn Recover, a: &DMatrix<f64>, y: &[f64]) -> (Vec<f64>, Solution) {
    let rows = Matrix::from(a);
    let solution = method
        .recover(&Problem::new(rows.view(), y).unwrap(), &mut Workspace::default())
        .unwrap();
    let mut x = vec![0.0; a.ncols()];
    solution.scatter(&mut x);
    (x, solution)
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

fn assert_near(got: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(got.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, (g, e)) in got.iter().zip(expected).enumerate() {
        assert!(
            (g - e).abs() <= tolerance * largest,
            "{what}: entry {i} is {g}, expected {e}"
        );
    }
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
        let (w, _) = solve(&method, &a, &y);
        let expected = numbers(&recorded["w"]);
        let objective = |w: &[f64]| lasso(&a, &y, w, alpha);
        // the gap bounds how far ours is above the smallest objective; the other program's can only be above it as well
        let allowed = 1e-12 * objective(&vec![0.0; k]);
        assert!(
            objective(&w) <= objective(&expected) + allowed,
            "case {seed}: objective"
        );
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
        let (x, _) = solve(&method, &a, &y);
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
        let (x, solution) = solve(&method, &a, &y);
        let inverse = (&a * &c * a.transpose() + deviation.powi(2) * DMatrix::identity(m, m))
            .try_inverse()
            .unwrap();
        let gain = &c * a.transpose() * inverse;
        let y = DVector::from_vec(y);
        let expected = &mean + &gain * (&y - &a * &mean);
        // condition below 1e4: 1e4·ε with a margin of 100
        assert_near(&x, expected.as_slice(), 1e-10, &format!("M = {m}"));
        assert!((solution.residual_norm - (&y - &a * &expected).norm()).abs() < 1e-9);
    }
}

/// x ≥ 0, g = (Aᵀ A + σ² C⁻¹) x − Aᵀ y − σ² C⁻¹ μ ≥ 0 and xᵢ gᵢ = 0.
#[test]
fn non_negative_lmmse_satisfies_its_conditions() {
    for (m, k) in [(1, 30), (7, 30), (20, 30), (60, 30)] {
        let (a, y) = problem(11, m, k);
        let (gaussian, c, mean) = prior(13, k);
        let deviation = 0.1_f64;
        let method = NnLmmse::new(gaussian, Noise::Absolute(deviation)).unwrap();
        let (x, _) = solve(&method, &a, &y);
        let precision = c.try_inverse().unwrap() * deviation.powi(2);
        let x = DVector::from_vec(x);
        let linear = a.transpose() * DVector::from_vec(y.clone()) + &precision * mean;
        let slope = (a.transpose() * &a + precision) * &x - &linear;
        for i in 0..k {
            assert!(x[i] >= 0.0);
            // 1e-12 by its own measure, times what the other order of the sums leaves
            let tolerance = 1e-9 * linear.amax();
            assert!(slope[i] >= -tolerance, "M = {m}: slope {}", slope[i]);
            assert!(
                x[i] == 0.0 || slope[i].abs() <= tolerance,
                "M = {m}: slope {}",
                slope[i]
            );
        }
    }
}

/// Orthonormal columns: every unknown is alone, and every method has a closed form in c = Aᵀ y.
#[test]
fn orthonormal_columns_have_closed_forms() {
    let (m, k) = (12, 8);
    let a = problem(17, m, k).0.qr().q();
    let y = Uniform(19).vector(m);
    let c = a.transpose() * DVector::from_column_slice(&y);
    // soft threshold at M α
    let alpha = 0.02;
    let mut method = NnLasso::new(Penalty::Absolute(alpha)).unwrap();
    method.stopping.tol = 1e-14;
    let expected: Vec<f64> = c.iter().map(|c| (c - 12.0 * alpha).max(0.0)).collect();
    // a gap of 1e-14 in an objective of unit curvature is 1e-7 in a coefficient
    assert_near(&solve(&method, &a, &y).0, &expected, 1e-6, "lasso");
    // max(c, 0) over 1 + σ²
    let noise = Noise::Absolute(0.3);
    let white = Arc::new(Gaussian::white(k, 1.0).unwrap());
    let expected: Vec<f64> = c.iter().map(|c| c.max(0.0) / 1.09).collect();
    let method = NnLmmse::new(white, noise).unwrap();
    assert_near(&solve(&method, &a, &y).0, &expected, 1e-12, "non-negative lmmse");
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
        let upper = if lower > 0.0 && lower >= mean {
            mean
        } else {
            high - penalty / 6.0
        };
        let expected: Vec<f64> = (0..10).map(|i| if i < n1 { lower } else { upper }).collect();
        for (rows, cols) in [(1, 10), (10, 1)] {
            let mut method = Tv::new(rows, cols, Penalty::Absolute(alpha)).unwrap();
            method.stopping.tol = 1e-11;
            // a gap of 1e-11 ‖y‖² / 2 in an objective of unit curvature is below 1e-4 in a pixel
            assert_near(&solve(&method, &a, &y).0, &expected, 1e-4, &format!("{low} and {high}"));
        }
        assert_eq!(n1 + n2, 10);
    }
}

/// The gap that ends the descent, recomputed from its definition: primal objective minus ½ ‖y‖² − ½ ‖y − θ‖² at the
/// residual shrunk into the feasible set.
#[test]
fn lasso_gaps_are_at_most_1e_8() {
    for (seed, m, k) in [(1, 1, 40), (2, 7, 100), (3, 20, 100), (4, 25, 400), (5, 100, 60)] {
        let (a, y) = problem(seed, m, k);
        for share in [0.5, 0.1, 0.01, 1e-4] {
            let method = NnLasso::new(Penalty::Relative(share)).unwrap();
            let (w, _) = solve(&method, &a, &y);
            let (v, y) = (DVector::from_vec(w), DVector::from_column_slice(&y));
            let largest = (a.transpose() * &y).max();
            let residual = &y - &a * &v;
            let shrink = (share * largest / (a.transpose() * &residual).max()).min(1.0);
            let primal = 0.5 * residual.norm_squared() + share * largest * v.sum();
            let dual = 0.5 * y.norm_squared() - 0.5 * (&y - shrink * &residual).norm_squared();
            let gap = (primal - dual) / (0.5 * y.norm_squared());
            // the same number to the rounding of sums of M·K terms
            assert!(gap <= 1e-8 + 1e-13, "seed {seed}, share {share}: gap {gap:e}");
        }
    }
}
