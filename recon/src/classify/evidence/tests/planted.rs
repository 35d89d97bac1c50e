//! The classifier on planted shapes.

use super::{normal, range, run};
use crate::Matrix;
use crate::classify::{EvidenceClassifier, Library, TemplateModel};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// A window of `amplitude` times an image through ±1 weights, with noise.
struct PlantedWindow {
    phi: Matrix,
    y: Vec<f64>,
}

impl PlantedWindow {
    fn new(seed: u64, m: usize, image: &[f64], amplitude: f64, noise: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let signs: Vec<u64> = (0..m).map(|_| rng.random()).collect();
        let weights = signs
            .iter()
            .flat_map(|s| (0..image.len()).map(move |i| if s >> i & 1 == 1 { 1.0 } else { -1.0 }));
        let phi = Matrix::from_rows(m, image.len(), weights.collect()).unwrap();
        let signal = |row: &[f64]| -> f64 { row.iter().zip(image).map(|(a, b)| a * b).sum() };
        let y = (0..m)
            .map(|r| amplitude * (signal(phi.row(r)) + noise * normal(&mut rng)))
            .collect();
        Self { phi, y }
    }
}

pub(super) fn planted() -> (EvidenceClassifier, Vec<Vec<f64>>) {
    let shape = |taxels: &[usize]| {
        (0..36)
            .map(|i| if taxels.contains(&i) { 1.0 } else { 0.0 })
            .collect::<Vec<f64>>()
    };
    let images = vec![
        shape(&[7, 8, 13, 14]),
        shape(&[21, 22, 23, 24, 27, 28]),
        shape(&[10, 16, 22, 28]),
    ];
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    let library = Library::new(&Matrix::from_column_slices(36, &slices), &[3, 1, 2]).unwrap();
    let model = TemplateModel::new(6);
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
        let signs: Vec<f64> = (0..20 * 36)
            .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        let phi = Matrix::from_rows(20, 36, signs).unwrap();
        let y: Vec<f64> = (0..20)
            .map(|m| {
                let signal: f64 = phi.row(m).iter().zip(&images[which]).map(|(a, b)| a * b).sum();
                amplitude * (signal + 0.2 * normal(&mut rng))
            })
            .collect();
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

/// A library off by one taxel still classifies when its images are expected anywhere within reach.
#[test]
fn shifted_templates_find_shifted_objects() {
    let (_, images) = planted();
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    let images = Matrix::from_column_slices(36, &slices);
    let library = Library::new(&images, &[3, 1, 2]).unwrap();
    let share = |reach: usize, shift: [usize; 2]| {
        let model = TemplateModel {
            reach,
            ..TemplateModel::new(6)
        };
        let classifier = EvidenceClassifier::new(&model.classes(&library).unwrap(), range(), 0.05).unwrap();
        let mut right = 0;
        for trial in 0..60_u64 {
            let which = usize::try_from(trial % 3).unwrap();
            let mut moved = vec![0.0; 36];
            for (i, v) in images.column(which).iter().enumerate().filter(|(_, v)| **v > 0.0) {
                // up and to the left: there the planted shapes stay on the sheet
                moved[i - 6 * shift[0] - shift[1]] = *v;
            }
            let window = PlantedWindow::new(100 + trial, 20, &moved, 1.0, 0.2);
            let decision = run(&classifier, &window.phi, &window.y).3;
            right += usize::from(decision.label == Some([3, 1, 2][which]));
        }
        right
    };
    for (reach, shift) in [
        (1, [1, 0]),
        (1, [0, 1]),
        (1, [1, 1]),
        (2, [1, 1]),
        (2, [0, 1]),
        (2, [0, 0]),
    ] {
        let right = share(reach, shift);
        assert!(right >= 57, "reach {reach}, shift {shift:?}: {right} of 60");
    }
    assert!(share(0, [1, 1]) < 45, "what a shift does to templates that do not move");
}

/// Noise without any shape is more likely unknown than any class.
#[test]
fn noise_is_unknown() {
    let (classifier, _) = planted();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut unknown = 0;
    for _ in 0..50 {
        let signs: Vec<f64> = (0..40 * 36)
            .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        let phi = Matrix::from_rows(40, 36, signs).unwrap();
        let y: Vec<f64> = (0..40).map(|_| 2.0 * normal(&mut rng)).collect();
        unknown += i32::from(run(&classifier, &phi, &y).3.label.is_none());
    }
    assert!(unknown >= 45, "{unknown} of 50");
}

#[test]
fn degenerate_measurements_stay_finite() {
    let (classifier, _) = planted();
    let ones = Matrix::from_rows(4, 36, vec![1.0; 144]).unwrap();
    for y in [
        &[][..],
        &[1.0],
        &[0.0],
        &[0.0; 4],
        &[1e-300; 4],
        &[1e79, -1e79, 1e79, 1e79],
        &[-1e-79; 4],
    ] {
        let (_, _, posterior, decision) = run(&classifier, &ones, y);
        assert!(
            decision.probability.is_finite() && decision.probability > 0.0,
            "{y:?}: {decision:?}"
        );
        assert!(
            (posterior.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12,
            "{y:?}"
        );
    }
    let (_, _, prior, _) = run(&classifier, &ones, &[]);
    for (p, expected) in prior
        .probabilities
        .iter()
        .zip([0.95 / 3.0, 0.95 / 3.0, 0.95 / 3.0, 0.05])
    {
        assert!((p - expected).abs() < 1e-12, "{prior:?}");
    }
}
