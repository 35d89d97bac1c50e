//! The filter and the classifier against their definitions, in dense linear algebra.

use super::*;
use crate::AmplitudeRange;
use crate::checks::says;
use crate::recover::Gaussian;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const RANGE: [f64; 2] = [0.1, 10.0];

fn range() -> AmplitudeRange {
    AmplitudeRange::new(RANGE[0], RANGE[1]).unwrap()
}

fn uniform(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

fn component(rng: &mut ChaCha8Rng, label: Option<usize>, n: usize, rank: usize) -> Component {
    Component {
        label,
        weight: 1.0,
        mean: uniform(rng, n),
        factors: (0..rank).map(|_| uniform(rng, n)).collect(),
        noise_variance: 0.3,
    }
}

/// Feeds rows Φ and samples y into fresh state.
fn run(classifier: &EvidenceClassifier, phi: &Matrix, y: &[f64]) -> (Preparation, Evidence, Posterior, Decision) {
    let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
    let mut row = vec![0.0; classifier.bank().ncols()];
    for (m, y) in y.iter().enumerate() {
        row.fill(0.0);
        classifier.bank().accumulate_row(phi.row(m), &mut row);
        preparation.push(&row).unwrap();
        evidence.observe(&preparation, *y).unwrap();
    }
    let mut posterior = Posterior::default();
    let decision = classifier.decide(&preparation, &evidence, &mut posterior);
    (preparation, evidence, posterior, decision)
}

/// Density and posterior mean image of one component, straight from its definition: for every amplitude of a fine grid,
/// a Cholesky factorisation of the covariance of y.
fn direct(c: &Component, phi: &Matrix, y: &[f64]) -> (f64, Vec<f64>) {
    let (m, n) = (phi.nrows(), phi.ncols());
    let phi = DMatrix::from_row_slice(m, n, phi.view().values());
    let factors = DMatrix::from_fn(n, c.factors.len(), |i, k| c.factors[k][i]);
    let (mean, y) = (DVector::from_column_slice(&c.mean), DVector::from_column_slice(y));
    let white = DMatrix::identity(m, m) * c.noise_variance;
    let covariance = &phi * &factors * factors.transpose() * phi.transpose() + white;
    let chol = covariance.cholesky().unwrap();
    let log_det: f64 = 2.0 * chol.l_dirty().diagonal().iter().map(|v| v.ln()).sum::<f64>();
    let steps = 20_000_i32;
    let width = (RANGE[1] / RANGE[0]).ln();
    let (mut values, mut images) = (Vec::new(), Vec::new());
    for k in 0..steps {
        let s = RANGE[0] * (width * (f64::from(k) + 0.5) / f64::from(steps)).exp();
        let residual = &y / s - &phi * &mean;
        let solved = chol.solve(&residual);
        let constant = -(m as f64) * (s.ln() + 0.5 * std::f64::consts::TAU.ln());
        values.push(constant - 0.5 * (log_det + residual.dot(&solved)));
        images.push((&mean + &factors * factors.transpose() * phi.transpose() * solved) * s);
    }
    let peak = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = values.iter().map(|v| (v - peak).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let image = weights.iter().zip(&images).fold(DVector::zeros(n), |a, (w, x)| a + x * (w / sum));
    (peak + (sum / f64::from(steps)).ln(), image.as_slice().to_vec())
}

#[test]
fn one_component_equals_its_definition() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (m, rank) in [(5, 0), (8, 1), (12, 3), (30, 4)] {
        let c = component(&mut rng, Some(4), 9, rank);
        let phi = Matrix::from_rows(m, 9, uniform(&mut rng, m * 9)).unwrap();
        // samples of the model, so that the amplitude is found well inside its range
        let y: Vec<f64> = (0..m)
            .map(|i| {
                let signal: f64 = phi.row(i).iter().zip(&c.mean).map(|(a, b)| a * b).sum();
                1.3 * (signal + 0.4 * normal(&mut rng))
            })
            .collect();
        let classifier = EvidenceClassifier::new(std::slice::from_ref(&c), range(), 0.1).unwrap();
        let (_, _, posterior, decision) = run(&classifier, &phi, &y);
        let (expected, expected_image) = direct(&c, &phi, &y);
        // the amplitude's nodes cut a tail of few measurements (see `amplitude`): 2e-4 at M = 5, 2e-6 at 30
        let tolerance = 2e-3 * (-f64::from(u32::try_from(m).unwrap()) / 5.0).exp();
        let got = posterior.log_evidence[0];
        assert!((got - expected).abs() < tolerance, "M = {m}, rank {rank}: {got}, expected {expected}");
        assert_eq!((decision.label, decision.probability), (Some(4), 1.0));
        let covariance = DMatrix::from_fn(9, 9, |i, j| {
            let smooth: f64 = c.factors.iter().map(|f| f[i] * f[j]).sum();
            // a prior needs some variance in every direction: 1e-12 of the answer's
            smooth + if i == j { 1e-12 } else { 0.0 }
        });
        let prior = Gaussian::new(c.mean.clone(), Matrix::from(&covariance)).unwrap();
        let estimator = ImageEstimator::new(vec![prior], c.noise_variance.sqrt()).unwrap();
        let mut image = vec![0.0; 9];
        estimator.estimate(&posterior, phi.view(), &y, &mut Workspace::default(), &mut image).unwrap();
        for (g, e) in image.iter().zip(&expected_image) {
            assert!((g - e).abs() < 1e-6 + 10.0 * tolerance, "M = {m}, rank {rank}: image {g}, expected {e}");
        }
    }
}

/// Three places of a class, two classes and an unknown: sums of the components' own evidence by Bayes' theorem.
#[test]
fn mixtures_follow_bayes() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let labels = [Some(7), Some(2), None, Some(7), Some(7)];
    let mut components: Vec<Component> = labels.iter().map(|&l| component(&mut rng, l, 6, 2)).collect();
    components[3].weight = 2.5;
    let phi = Matrix::from_rows(10, 6, uniform(&mut rng, 60)).unwrap();
    let y = uniform(&mut rng, 10);
    let classifier = EvidenceClassifier::new(&components, range(), 0.05).unwrap();
    assert_eq!(classifier.outcomes(), [Some(2), Some(7), None]);
    let (_, _, posterior, _) = run(&classifier, &phi, &y);
    let alone = |c: &Component| {
        let one = EvidenceClassifier::new(std::slice::from_ref(c), range(), 0.05).unwrap();
        run(&one, &phi, &y).2.log_evidence[0].exp()
    };
    let e: Vec<f64> = components.iter().map(alone).collect();
    let by_outcome = [e[1], (e[0] + 2.5 * e[3] + e[4]) / 4.5, e[2]];
    let weighted: Vec<f64> = by_outcome.iter().zip([0.475, 0.475, 0.05]).map(|(e, p)| p * e).collect();
    let sum: f64 = weighted.iter().sum();
    for k in 0..3 {
        assert!((posterior.log_evidence[k] - by_outcome[k].ln()).abs() < 1e-10);
        assert!((posterior.probabilities[k] - weighted[k] / sum).abs() < 1e-10);
    }
}

#[test]
fn windows_add_their_evidence() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let components = [component(&mut rng, Some(1), 6, 2), component(&mut rng, Some(2), 6, 2)];
    let classifier = EvidenceClassifier::new(&components, range(), 0.1).unwrap();
    let phi = Matrix::from_rows(6, 6, uniform(&mut rng, 36)).unwrap();
    let y = uniform(&mut rng, 6);
    let (preparation, mut evidence, mut posterior, _) = run(&classifier, &phi, &y);
    let once = posterior.log_evidence.clone();
    classifier.next_window(&preparation, &mut evidence, &mut posterior);
    assert_eq!(evidence.count(), 0);
    classifier.decide(&preparation, &evidence, &mut posterior);
    for (empty, once) in posterior.log_evidence.iter().zip(&once) {
        assert!((empty - once).abs() < 1e-12 * once.abs(), "an empty window says nothing");
    }
    for y in &y {
        evidence.observe(&preparation, *y).unwrap();
    }
    classifier.decide(&preparation, &evidence, &mut posterior);
    for (twice, once) in posterior.log_evidence.iter().zip(&once) {
        assert!((twice - 2.0 * once).abs() < 1e-12 * once.abs());
    }
    evidence.clear();
    assert_eq!(evidence, classifier.evidence());
}

/// Preparing ahead, or in a used preparation, changes nothing.
#[test]
fn preparation_can_run_ahead_and_be_used_again() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let components: Vec<Component> = (0..6).map(|k| component(&mut rng, Some(k), 5, 3)).collect();
    let classifier = EvidenceClassifier::new(&components, range(), 0.1).unwrap();
    let phi = Matrix::from_rows(20, 5, uniform(&mut rng, 100)).unwrap();
    let y = uniform(&mut rng, 7);
    let (_, _, expected, _) = run(&classifier, &phi, &y);
    let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
    let mut posterior = Posterior::default();
    for _ in 0..2 {
        preparation.clear();
        evidence.clear();
        for m in 0..20 {
            let mut row = vec![0.0; classifier.bank().ncols()];
            classifier.bank().accumulate_row(phi.row(m), &mut row);
            preparation.push(&row).unwrap();
        }
        for y in &y {
            evidence.observe(&preparation, *y).unwrap();
        }
        classifier.decide(&preparation, &evidence, &mut posterior);
        assert_eq!(posterior, expected);
    }
}

#[test]
fn refuses_what_it_cannot_use() {
    let (classifier, _) = planted();
    let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
    let before = evidence.clone();
    assert!(says(&evidence.observe(&preparation, 1.0), "measurement 0 arrived, but only 0 rows"));
    let width = classifier.bank().ncols();
    assert!(preparation.push(&vec![1.0; width - 1]).is_err());
    assert!(preparation.push(&vec![f64::NAN; width]).is_err());
    preparation.push(&vec![1.0; width]).unwrap();
    for y in [f64::NAN, f64::NEG_INFINITY, 1e300] {
        assert!(says(&evidence.observe(&preparation, y), "is outside"), "{y}");
    }
    assert_eq!(evidence, before);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let good = component(&mut rng, Some(1), 4, 1);
    let other = EvidenceClassifier::new(std::slice::from_ref(&good), range(), 0.1).unwrap();
    assert!(other.evidence().observe(&preparation, 1.0).is_err(), "another classifier's preparation");
    let new = |c: &[Component]| EvidenceClassifier::new(c, range(), 0.1);
    assert!(new(&[]).unwrap_err().to_string().contains("there is no component"));
    let bad = Component { factors: vec![vec![1.0; 3]], ..good.clone() };
    assert!(new(&[good, bad]).is_err());
}

/// A window of `amplitude` times an image through ±1 weights, with noise.
struct PlantedWindow {
    phi: Matrix,
    y: Vec<f64>,
}

impl PlantedWindow {
    fn new(seed: u64, m: usize, image: &[f64], amplitude: f64, noise: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let signs: Vec<u64> = (0..m).map(|_| rng.random()).collect();
        let weights =
            signs.iter().flat_map(|s| (0..image.len()).map(move |i| if s >> i & 1 == 1 { 1.0 } else { -1.0 }));
        let phi = Matrix::from_rows(m, image.len(), weights.collect()).unwrap();
        let signal = |row: &[f64]| -> f64 { row.iter().zip(image).map(|(a, b)| a * b).sum() };
        let y = (0..m).map(|r| amplitude * (signal(phi.row(r)) + noise * normal(&mut rng))).collect();
        Self { phi, y }
    }
}

pub(super) fn planted() -> (EvidenceClassifier, Vec<Vec<f64>>) {
    let shape = |taxels: &[usize]| (0..36).map(|i| if taxels.contains(&i) { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let images = vec![shape(&[7, 8, 13, 14]), shape(&[21, 22, 23, 24, 27, 28]), shape(&[10, 16, 22, 28])];
    let library = Library::new(&Matrix::from_column_slices(36, &images), &[3, 1, 2]).unwrap();
    // all windows are of one mounting
    let model = TemplateModel { tilt: 0.0, ..TemplateModel::new(6) };
    let mut components = model.classes(&library).unwrap();
    components.push(model.unknown(&library).unwrap());
    (EvidenceClassifier::new(&components, range(), 0.05).unwrap(), images)
}

/// Twenty signs are enough to tell three planted shapes apart at any amplitude, and the probability grows with them.
#[test]
fn finds_planted_classes() {
    let (classifier, images) = planted();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut right, mut sure) = (0, [0.0; 2]);
    let trials = 100;
    for trial in 0..trials {
        let which = trial % 3;
        let amplitude = rng.random_range(0.3..3.0);
        let PlantedWindow { phi, y } = PlantedWindow::new(trial as u64, 20, &images[which], amplitude, 0.2);
        let (_, _, posterior, decision) = run(&classifier, &phi, &y);
        let (_, _, early, _) = run(&classifier, &phi, &y[..1]);
        let label = [3, 1, 2][which];
        right += usize::from(decision.label == Some(label));
        let at = classifier.outcomes().iter().position(|o| *o == Some(label)).unwrap();
        sure = [sure[0] + early.probabilities[at], sure[1] + posterior.probabilities[at]];
        assert!((posterior.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
    assert!(right >= 99, "{right} of {trials}");
    assert!(sure[1] > 95.0 && sure[1] > sure[0] + 5.0, "{sure:?}");
}

/// Noise without any shape is more likely unknown than any class.
#[test]
fn noise_is_unknown() {
    let (classifier, _) = planted();
    let mut unknown = 0;
    for seed in 0..50 {
        let window = PlantedWindow::new(seed, 40, &[0.0; 36], 2.0, 1.0);
        unknown += i32::from(run(&classifier, &window.phi, &window.y).3.label.is_none());
    }
    assert!(unknown >= 45, "{unknown} of 50");
}

#[test]
fn degenerate_measurements_stay_finite() {
    let (classifier, _) = planted();
    let ones = Matrix::from_rows(4, 36, vec![1.0; 144]).unwrap();
    for y in [&[][..], &[1.0], &[0.0], &[0.0; 4], &[1e-300; 4], &[1e79, -1e79, 1e79, 1e79], &[-1e-79; 4]] {
        let (_, _, posterior, decision) = run(&classifier, &ones, y);
        assert!(decision.probability.is_finite() && decision.probability > 0.0, "{y:?}: {decision:?}");
        assert!((posterior.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{y:?}");
    }
    let (_, _, prior, _) = run(&classifier, &ones, &[]);
    for (p, expected) in prior.probabilities.iter().zip([0.95 / 3.0, 0.95 / 3.0, 0.95 / 3.0, 0.05]) {
        assert!((p - expected).abs() < 1e-12, "{prior:?}");
    }
}

#[test]
fn takes_the_class_whose_images_explain_it() {
    let images = Matrix::from_column_slices(
        4,
        &[&[1.0, 0.0, 0.0, 0.0], &[1.0, 0.2, 0.0, 0.0], &[0.0; 4], &[0.0, 0.0, 1.0, 1.0]],
    );
    let classifier = Src::new(Library::new(&images, &[3, 3, 0, 8]).unwrap(), 3);
    let mut work = Workspace::default();
    assert_eq!(classifier.classify(&[2.0, 0.3, 0.1, 0.0], &mut work).unwrap(), Some(3));
    assert_eq!(classifier.classify(&[0.1, 0.0, 0.9, 1.1], &mut work).unwrap(), Some(8));
    assert_eq!(classifier.classify(&[0.0; 4], &mut work).unwrap(), None);
    assert!(classifier.classify(&[f64::NAN; 4], &mut work).is_err());
}

#[test]
fn refuses_labels_that_do_not_fit() {
    let images = Matrix::zeros(4, 2);
    assert!(says(&Library::new(&images, &[1]), "library has 2 images but 1 labels"));
    assert!(says(&Library::new(&images, &[1, 2]), "library holds no image"));
}

#[test]
fn ties_go_to_the_lowest_label_and_the_undecided_do_not_vote() {
    assert_eq!(majority(&[Some(4), Some(2), Some(4), Some(2), None]), Some(2));
    assert_eq!(majority(&[None, None]), None);
    let decisions = [Some(1), Some(1), Some(2), Some(2), Some(2), Some(9)];
    assert_eq!(vote_groups(&decisions, 2, false), [Some(1), Some(2), Some(2)]);
    assert_eq!(vote_groups(&decisions, 2, true), [Some(1), Some(1), Some(2)]);
    assert_eq!(vote_groups(&decisions[..1], 2, false), []);
}
