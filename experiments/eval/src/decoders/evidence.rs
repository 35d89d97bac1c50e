//! Classification by the evidence of Gaussian classes given y.

use super::bank::Bank;
use crate::algorithm::{Algorithm, Answer, Belief, Class, Confidence, DecodeError, Subject, Trained};
use crate::training::{LearnError, TrainingData, in_parameter, in_range, in_templates, simulated_gain_sd};
use crate::windows::Window;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;
use spts_recon::classify::{
    ClusterModel, Clusters, Evidence, EvidenceClassifier, ImageEstimator, Posterior, Preparation, TemplateModel,
};
use spts_recon::{AmplitudeRange, Matrix, Workspace};

/// Amplitudes of a press that count as possible, V at the strongest taxel: sessions of one object differ by .50–1.38,
/// objects by .4–1.7.
const AMPLITUDES_V: [f64; 2] = [0.2, 6.0];

/// Noise of a measurement that images are made with, as a share of the strongest taxel: 5–7 % of the image's length,
/// which is 3–4 times the strongest taxel.
const IMAGE_NOISE: f64 = 0.2;

/// Prior probability of an object that is in no class; not used, because every decoder of the board is asked for these
/// classes only.
const UNKNOWN_PRIOR: f64 = 0.01;

/// Eigenvectors for a skin that is none of those learned from, whose gains scatter taxel by taxel: on simulated windows
/// of other simulated skins they classify .946 at M = 20, eight .926, thirty .947, and the model without gains .886.
const OTHER_SKIN_RANK: usize = 20;

struct Classes {
    classifier: EvidenceClassifier,
    images: ImageEstimator,
    bank: Bank,
}

/// Objects whose poses are not known: a dozen clusters of poses each score as thirty do. Noise as of images, and what a
/// press differs by.
const POSES: ClusterModel = ClusterModel {
    clusters: 12,
    gain: 0.0,
    floor: 0.01,
    noise: 0.15,
    rank: OTHER_SKIN_RANK,
};
/// Lengths of an image that count as possible, V.
const LENGTHS_V: [f64; 2] = [0.05, 50.0];
/// Root of the random numbers of the clusters.
const SEED: u64 = 1;

pub(super) fn train(data: &TrainingData) -> Result<Box<dyn Trained>, LearnError> {
    if let Some((images, labels)) = data.posed() {
        return posed(images, labels);
    }
    let mut model = TemplateModel::new(data.shape[1]);
    if data.gain_sd.iter().any(|gain| *gain > 0.0) {
        model.gains.clone_from(&data.gain_sd);
        model.rank = OTHER_SKIN_RANK;
    }
    let components = model.classes(&data.templates).map_err(in_templates)?;
    let amplitude = AmplitudeRange::new(AMPLITUDES_V[0], AMPLITUDES_V[1]).map_err(in_range)?;
    let classifier = EvidenceClassifier::new(&components, amplitude, UNKNOWN_PRIOR).map_err(in_templates)?;
    Ok(Box::new(Classes {
        bank: Bank::new(classifier.bank()),
        images: ImageEstimator::new(model.image_priors(&data.templates).map_err(in_templates)?, IMAGE_NOISE)
            .map_err(in_parameter)?,
        classifier,
    }))
}

/// Classes of objects in many poses, which are marginalised; the gains are not known.
fn posed(images: &Matrix, labels: &[usize]) -> Result<Box<dyn Trained>, LearnError> {
    let gain = simulated_gain_sd();
    let model = ClusterModel { gain, ..POSES };
    let mut classes = labels.to_vec();
    classes.dedup();
    let mut all = Clusters::default();
    for label in classes {
        let own: Vec<Vec<f64>> = (0..labels.len())
            .filter(|&k| labels[k] == label)
            .map(|k| images.column(k))
            .collect();
        let slices: Vec<&[f64]> = own.iter().map(Vec::as_slice).collect();
        let own = Matrix::from_column_slices(images.nrows(), &slices);
        all.add(
            model
                .learn(&own, label, &mut ChaCha8Rng::seed_from_u64(SEED))
                .map_err(in_templates)?,
        );
    }
    let amplitude = AmplitudeRange::new(LENGTHS_V[0], LENGTHS_V[1]).map_err(in_range)?;
    let classifier = EvidenceClassifier::new(&all.components, amplitude, UNKNOWN_PRIOR).map_err(in_templates)?;
    Ok(Box::new(Classes {
        bank: Bank::new(classifier.bank()),
        images: ImageEstimator::new(all.priors, model.noise).map_err(in_parameter)?,
        classifier,
    }))
}

impl Classes {
    fn at_work(&self) -> AtWork<'_> {
        AtWork {
            classes: self,
            preparation: self.classifier.preparation(),
            evidence: self.classifier.evidence(),
            posterior: Posterior::default(),
            rows: Vec::new(),
            work: Workspace::default(),
        }
    }
}

impl Trained for Classes {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(self.at_work())
    }

    fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
        Some((Subject::Class, Box::new(self.at_work())))
    }
}

struct AtWork<'a> {
    classes: &'a Classes,
    preparation: Preparation,
    evidence: Evidence,
    posterior: Posterior,
    rows: Vec<f64>,
    work: Workspace,
}

impl AtWork<'_> {
    /// Takes a window of its own.
    fn take(&mut self, window: &Window<'_>) -> Result<(), Refusal> {
        self.preparation.clear();
        self.extend(window)
    }

    /// Takes more measurements of the same window.
    fn extend(&mut self, window: &Window<'_>) -> Result<(), Refusal> {
        let bank = self.classes.classifier.bank();
        let columns = bank.ncols().max(1);
        self.classes.bank.project(bank, window, &mut self.rows);
        for (row, &y) in self.rows.chunks_exact(columns).zip(window.y) {
            self.preparation.push(row)?;
            self.evidence.observe(&self.preparation, y)?;
        }
        Ok(())
    }

    fn decide(&mut self) -> (Class, f64) {
        let classifier = &self.classes.classifier;
        let decision = classifier.decide(&self.preparation, &self.evidence, &mut self.posterior);
        let class = decision.label.map_or(Class::Unknown, Class::Known);
        (class, decision.probability)
    }
}

impl Confidence for AtWork<'_> {
    fn begin(&mut self) {
        self.preparation.clear();
        self.evidence.clear();
    }

    fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
        self.extend(sample)?;
        let (class, confidence) = self.decide();
        Ok(Belief {
            confidence,
            class: Some(class),
        })
    }
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        self.evidence.clear();
        self.take(window)?;
        answer.class = Some(self.decide().0);
        answer.image.resize(window.phi.ncols(), 0.0);
        self.classes
            .images
            .estimate(&self.posterior, window.phi, window.y, &mut self.work, &mut answer.image)?;
        Ok(())
    }

    fn sum(&mut self, windows: &[Window<'_>]) -> Option<Class> {
        self.evidence.clear();
        for window in windows {
            if self.take(window).is_err() {
                return Some(Class::Unknown);
            }
            let classifier = &self.classes.classifier;
            classifier.next_window(&self.preparation, &mut self.evidence, &mut self.posterior);
        }
        Some(self.decide().0)
    }
}
