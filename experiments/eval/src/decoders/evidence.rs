//! Gaussian components weighed by their evidence given y: classes with an image each, and a mixture of shapes.

use crate::algorithm::{Algorithm, Answer, Belief, Class, Confidence, DecodeError, Subject, Trained};
use crate::training::{TrainingData, simulated_gain_sd};
use crate::windows::Window;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;
use spts_recon::classify::{
    ClusterModel, Clusters, Component, Evidence, EvidenceClassifier, ImageEstimator, Posterior, Preparation,
    TemplateModel,
};
use spts_recon::{AmplitudeRange, Matrix, SignTables, Workspace};

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

/// Matrices of taxels × taxels that a component is learned with: its covariance, and what its eigenvectors take.
const SQUARES: f64 = 3.0;

struct Classes {
    classifier: EvidenceClassifier,
    images: ImageEstimator,
    bank: Bank,
    /// Whether the components are classes with names.
    named: bool,
}

/// Objects whose poses are not known: a dozen clusters of poses each score as thirty do. Noise as of images, and what a
/// press differs by.
const POSES: ClusterModel = ClusterModel { clusters: 12, gain: 0.0, floor: 0.01, noise: 0.15, rank: OTHER_SKIN_RANK };
/// Lengths of an image that count as possible, V.
const LENGTHS_V: [f64; 2] = [0.05, 50.0];
/// Root of the random numbers of the clusters.
const SEED: u64 = 1;

/// Thirty clusters; a hundred score no better. Gains scatter as those of the skins in the published recordings.
const SHAPES: ClusterModel = ClusterModel { clusters: 30, gain: 0.3, floor: 0.01, noise: 0.12, rank: 20 };
/// Weight of the wide component, so that a cluster takes over only where the evidence is clear.
const APART: f64 = 0.99;
/// Components that are solved with non-negative taxels.
const SOLVED: usize = 2;

pub(super) fn train(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    data.check_learned()?;
    data.fits_squares("covariances", SQUARES)?;
    if let Some((images, labels)) = data.posed() {
        return posed(images, labels);
    }
    let mut model = TemplateModel::new(data.shape[1]);
    if data.gain_sd.iter().any(|gain| *gain > 0.0) {
        model.gains.clone_from(&data.gain_sd);
        model.rank = OTHER_SKIN_RANK;
    }
    let templates = |e: Refusal| e.at("templates");
    let components = model.classes(&data.templates).map_err(templates)?;
    let priors = model.image_priors(&data.templates).map_err(templates)?;
    let images = ImageEstimator::new(priors, IMAGE_NOISE).map_err(|e| e.at("parameter"))?;
    Classes::trained(&components, AMPLITUDES_V, UNKNOWN_PRIOR, images, true)
}

/// A mixture of clusters of procedural shapes: images alone, weighted by the evidence given y.
pub(super) fn mixture(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    data.check_learned()?;
    data.fits_squares("covariances", SQUARES)?;
    let clusters = Clusters::with_wide(&SHAPES, data.alike(), APART, &mut ChaCha8Rng::seed_from_u64(SEED));
    let clusters = clusters.map_err(|e| e.at("templates"))?;
    let images = ImageEstimator::non_negative(clusters.priors, SHAPES.noise, SOLVED).map_err(|e| e.at("parameter"))?;
    // every component has the same label, so that no unknown one is weighed
    Classes::trained(&clusters.components, LENGTHS_V, 0.5, images, false)
}

/// Classes of objects in many poses, which are marginalised; the gains are not known.
fn posed(images: &Matrix, labels: &[usize]) -> Result<Box<dyn Trained>, Refusal> {
    let gain = simulated_gain_sd();
    let model = ClusterModel { gain, ..POSES };
    let mut classes = labels.to_vec();
    classes.dedup();
    let mut all = Clusters::default();
    for label in classes {
        let own = (0..labels.len()).filter(|&k| labels[k] == label);
        let own: Vec<Vec<f64>> = own.map(|k| images.column(k)).collect();
        let own = Matrix::from_column_slices(images.nrows(), &own);
        let clusters = model.learn(&own, label, &mut ChaCha8Rng::seed_from_u64(SEED));
        all.add(clusters.map_err(|e| e.at("templates"))?);
    }
    let images = ImageEstimator::new(all.priors, model.noise).map_err(|e| e.at("parameter"))?;
    Classes::trained(&all.components, LENGTHS_V, UNKNOWN_PRIOR, images, true)
}

impl Classes {
    fn trained(
        components: &[Component],
        [least_v, most_v]: [f64; 2],
        unknown: f64,
        images: ImageEstimator,
        named: bool,
    ) -> Result<Box<dyn Trained>, Refusal> {
        let amplitude = AmplitudeRange::new(least_v, most_v).map_err(|e| e.at("range"))?;
        let classifier = EvidenceClassifier::new(components, amplitude, unknown).map_err(|e| e.at("templates"))?;
        Ok(Box::new(Self { bank: Bank::new(classifier.bank()), classifier, images, named }))
    }

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
        self.named.then(|| (Subject::Class, Box::new(self.at_work()) as Box<dyn Confidence + '_>))
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
        Ok(Belief { confidence, class: Some(class) })
    }
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        self.evidence.clear();
        self.take(window)?;
        let class = self.decide().0;
        answer.class = self.classes.named.then_some(class);
        answer.image.resize(window.phi.ncols(), 0.0);
        self.classes.images.estimate(&self.posterior, window.phi, window.y, &mut self.work, &mut answer.image)?;
        Ok(())
    }

    fn sum(&mut self, windows: &[Window<'_>]) -> Option<Class> {
        if !self.classes.named {
            return None;
        }
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

/// Up to this many columns rows are looked up; the tables of more no longer fit a cache.
const FEW_COLUMNS: usize = 1200;

/// Forms rows of Φ times the bank.
struct Bank {
    tables: Option<SignTables<f64>>,
}

impl Bank {
    fn new(bank: &Matrix) -> Self {
        let few = bank.ncols() <= FEW_COLUMNS;
        Self { tables: few.then(|| SignTables::new(bank.view())) }
    }

    /// Overwrites `rows` with one row of Φ times `bank` (taxels × columns) for every measurement of `window`.
    fn project(&self, bank: &Matrix, window: &Window<'_>, rows: &mut Vec<f64>) {
        let columns = bank.ncols().max(1);
        rows.resize(window.y.len() * columns, 0.0);
        if let (Some(tables), Some(signs)) = (&self.tables, window.signs) {
            return tables.fill_rows(signs, rows);
        }
        let phi = window.phi.values().chunks_exact(window.phi.ncols().max(1));
        for (row, out) in phi.zip(rows.chunks_exact_mut(columns)) {
            out.fill(0.0);
            bank.accumulate_row(row, out);
        }
    }
}
