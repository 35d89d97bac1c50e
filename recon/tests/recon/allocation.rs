//! A decode allocates nothing once workspace and answer have their size.

use allocation_counter::measure;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{EvidenceClassifier, ImageEstimator, Library, Posterior, Src, TemplateModel};
use spts_recon::recover::{BatchOmp, RECOVER, REGULARISED};
use spts_recon::{AmplitudeRange, Matrix, Problem, Recover, Solution, Workspace};

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
        let (mut work, mut solution) = (Workspace::default(), Solution::default());
        let shared = BatchOmp::new(a.view(), 6).unwrap();
        let mut decode = || shared.recover_into(&y, &mut work, &mut solution).unwrap();
        decode();
        assert_eq!(measure(decode).count_total, 0, "shared operator, M = {m}");
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
    let (images, phi, y) = (
        Matrix::from_rows(36, 3, draw(36 * 3)).unwrap(),
        Matrix::from_rows(20, 36, draw(20 * 36)).unwrap(),
        draw(20),
    );
    let (library, model) = (Library::new(&images, &[1, 2, 3]).unwrap(), TemplateModel::new(6));
    let range = AmplitudeRange::new(0.1, 10.0).unwrap();
    let classifier = EvidenceClassifier::new(&model.classes(&library).unwrap(), range, 0.05).unwrap();
    let estimator = ImageEstimator::new(model.image_priors(&library).unwrap(), 0.1).unwrap();
    // before the first sample every component has its share
    let mut posterior = Posterior::default();
    classifier.decide(&classifier.preparation(), &classifier.evidence(), &mut posterior);
    let (mut work, mut image) = (Workspace::default(), vec![0.0; 36]);
    let mut decode = || {
        estimator
            .estimate(&posterior, phi.view(), &y, &mut work, &mut image)
            .unwrap();
    };
    decode();
    assert_eq!(measure(decode).count_total, 0);
    assert!(image.iter().any(|v| *v != 0.0));
}
