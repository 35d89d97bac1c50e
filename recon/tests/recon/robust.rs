//! Every algorithm of both tables at the edge of sense, at scales where squares overflow or vanish, and without
//! allocations.

use crate::helpers::says;
use allocation_counter::measure;
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;
use spts_recon::classify::{EvidenceClassifier, ImageEstimator, Library, Posterior, Src, TemplateModel};
use spts_recon::recover::{Build, RECOVER, REGULARISED};
use spts_recon::{AmplitudeRange, Matrix, Problem, Recover, Solution, Workspace};

/// Both tables, for K unknowns and S atoms.
fn methods(k: usize, n_nonzero_coefs: usize) -> Vec<(&'static str, Box<dyn Recover>)> {
    let pursuits = RECOVER.iter().map(|(name, build)| (*name, build(n_nonzero_coefs)));
    let regularised = REGULARISED.iter().map(|(name, build)| (*name, build(k).unwrap()));
    pursuits.chain(regularised).collect()
}

fn is_finite(solution: &Solution) -> bool {
    solution.residual_norm.is_finite() && solution.coefficients.iter().all(|c| c.is_finite())
}

/// An error that scales alone can bring about.
fn is_out_of_range(error: &Refusal) -> bool {
    let error = error.to_string();
    error.contains("exceeds the range of 64-bit numbers") || error.starts_with("operator[")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// M from 1 to above K, S to above both, columns that are zero or there twice, and scales from one end of the range
    /// to the other.
    #[test]
    fn any_shape_and_scale_gives_finite_numbers_or_an_error(
        seed in any::<u64>(), m in 1_usize..24, k in 1_usize..16, s in 0_usize..30, twins in any::<bool>(), zeros in any::<bool>(),
        a_exponent in -300_i32..=300, y_exponent in -300_i32..=300,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |len: usize, exponent: i32| -> Vec<f64> {
            let scale = 10.0_f64.powi(exponent);
            (0..len).map(|_| scale * rng.random_range(-1.0..1.0)).collect()
        };
        let mut a = Matrix::from_rows(m, k, draw(m * k, a_exponent)).unwrap();
        let y = draw(m, y_exponent);
        if twins {
            a.set_column(k - 1, &a.column(0));
        }
        if zeros {
            a.set_column(k / 2, &vec![0.0; m]);
        }
        let problem = Problem::new(a.view(), &y).unwrap();
        for (name, method) in methods(k, s) {
            match method.recover(&problem, &mut Workspace::default()) {
                Ok(solution) => prop_assert!(is_finite(&solution), "{name}: {solution:?}"),
                Err(error) => prop_assert!(is_out_of_range(&error), "{name}: {error}"),
            }
        }
    }
}

fn drawn(m: usize, k: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut values = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    (values(m * k), values(m))
}

/// The pursuits that scale their problem first.
fn scaling() -> impl Iterator<Item = &'static (&'static str, Build)> {
    RECOVER.iter().filter(|(name, _)| *name != "reference")
}

/// By a power of two the answer keeps every digit.
#[test]
fn operators_and_measurements_of_any_scale_are_the_same_problem() {
    let (m, k, s) = (20, 60, 5);
    let (values, y) = drawn(m, k);
    let scaled = |v: &[f64], e: i32| -> Vec<f64> { v.iter().map(|v| v * 2.0_f64.powi(e)).collect() };
    for (name, build) in scaling() {
        let solve = |a_exponent, y_exponent| {
            let a = Matrix::from_rows(m, k, scaled(&values, a_exponent)).unwrap();
            let y = scaled(&y, y_exponent);
            build(s).recover(&Problem::new(a.view(), &y).unwrap(), &mut Workspace::default())
        };
        let unit = solve(0, 0).unwrap();
        for (a_exponent, y_exponent) in
            [(-900, 0), (900, 0), (-900, -900), (900, 900), (0, 1000), (0, -900), (500, -400)]
        {
            let got = solve(a_exponent, y_exponent).unwrap();
            assert_eq!(got.support, unit.support, "{name}: A·2^{a_exponent}, y·2^{y_exponent}");
            for (g, e) in got.coefficients.iter().zip(&unit.coefficients) {
                let back = g * 2.0_f64.powi(a_exponent - y_exponent);
                // iterations may end one step apart
                assert!((back - e).abs() <= 1e-9 * e.abs(), "{name}: {back}, expected {e}");
            }
        }
        assert!(says(&solve(-1000, 1000), "the coefficient of atom"), "{name}");
    }
}

/// Unknowns where allocations are counted.
const K: usize = 40;

/// Allocations of a decode that has been done before.
fn assert_none(name: &str, method: &dyn Recover, a: &Matrix, y: &[f64]) {
    let problem = Problem::new(a.view(), y).unwrap();
    let (mut work, mut solution) = (Workspace::default(), Solution::default());
    method.recover_into(&problem, &mut work, &mut solution).unwrap();
    let again = measure(|| method.recover_into(&problem, &mut work, &mut solution).unwrap());
    assert_eq!(again.count_total, 0, "{name}, M = {}", a.nrows());
}

#[test]
fn no_decode_allocates() {
    // the counter counts
    assert!(measure(|| drop(std::hint::black_box(vec![0_u8; 64]))).count_total > 0);
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for m in [1, 20, 60] {
        let mut draw = |len: usize| -> Vec<f64> { (0..len).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (a, y) = (Matrix::from_rows(m, K, draw(m * K)).unwrap(), draw(m));
        for (name, build) in RECOVER {
            assert_none(name, &*build(6), &a, &y);
        }
        for (name, build) in REGULARISED {
            assert_none(name, &*build(K).unwrap(), &a, &y);
        }
    }
}

#[test]
fn no_classification_allocates() {
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let mut draw = |len: usize| -> Vec<f64> { (0..len).map(|_| rng.random_range(0.0..1.0)).collect() };
    let (images, image) = (Matrix::from_rows(30, K, draw(30 * K)).unwrap(), draw(30));
    let labels: Vec<usize> = (0..K).map(|k| k / 4).collect();
    let library = Library::new(&images, &labels).unwrap();
    let mut work = Workspace::default();
    let classifier = Src::new(library, 10);
    classifier.classify(&image, &mut work).unwrap();
    let again = measure(|| {
        classifier.classify(&image, &mut work).unwrap();
    });
    assert_eq!(again.count_total, 0);
}

#[test]
fn no_image_of_a_decision_allocates() {
    let mut rng = ChaCha8Rng::seed_from_u64(33);
    let mut draw = |len: usize| -> Vec<f64> { (0..len).map(|_| rng.random_range(0.1..1.0)).collect() };
    let (images, phi, y) =
        (Matrix::from_rows(36, 3, draw(36 * 3)).unwrap(), Matrix::from_rows(20, 36, draw(20 * 36)).unwrap(), draw(20));
    let (library, model) = (Library::new(&images, &[1, 2, 3]).unwrap(), TemplateModel::new(6));
    let range = AmplitudeRange::new(0.1, 10.0).unwrap();
    let classifier = EvidenceClassifier::new(&model.classes(&library).unwrap(), range, 0.05).unwrap();
    let estimator = ImageEstimator::new(model.image_priors(&library).unwrap(), 0.1).unwrap();
    // before the first sample every component has its share
    let mut posterior = Posterior::default();
    classifier.decide(&classifier.preparation(), &classifier.evidence(), &mut posterior);
    let (mut work, mut image) = (Workspace::default(), vec![0.0; 36]);
    let mut decode = || {
        estimator.estimate(&posterior, phi.view(), &y, &mut work, &mut image).unwrap();
    };
    decode();
    assert_eq!(measure(decode).count_total, 0);
    assert!(image.iter().any(|v| *v != 0.0));
}
