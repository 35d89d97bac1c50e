//! Decoders that reconstruct an image, from atoms of a dictionary or directly from taxels.

use crate::algorithm::{Algorithm, Answer, Belief, Confidence, DecodeError, Subject, Trained};
use crate::training::{Dictionary, TrainingData};
use crate::windows::Window;
use spts_input::Refusal;
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::{
    Gaussian, ImagePrior, Lmmse, NnLasso, NnLmmse, NnOmp, Noise, Omp, Penalty, ReferenceOmp, SequentialEstimate,
    SequentialGains, Tv,
};
use spts_recon::{MatrixView, Problem, Recover, Solution, Workspace};
use std::sync::Arc;

/// M/4 rounded half up, at least 1: the published rule for the number of atoms.
pub fn quarter(m: usize) -> usize {
    ((m + 2) / 4).max(1)
}

/// Most atoms of the published script.
const SCRIPT_ATOMS: usize = 20;
/// Weight of the ℓ₁ norm, as a share of the one that leaves nothing.
const LASSO: Penalty = Penalty::Relative(0.1);
/// Contact noise and what a prior misses, as a share of the root mean square of y.
const NOISE: Noise = Noise::Relative(0.12);
/// Weight of the total variation, as a share of the largest correlation.
const VARIATION: Penalty = Penalty::Relative(0.02);

/// How the cells' weights are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Weights {
    /// ±1, the levels of the cells about their middle; the idle output is subtracted from y.
    Signs,
    /// {0, 1}, with y unchanged, as in the published script.
    Script,
}

/// An algorithm for M measurements.
type Build = dyn Fn(usize) -> Box<dyn Recover> + Send + Sync;

/// What is recovered.
enum Unknowns {
    /// Coefficients of atoms.
    Atoms(Arc<Dictionary>),
    /// Taxels.
    Taxels,
}

struct ImageDecoder {
    unknowns: Unknowns,
    weights: Weights,
    build: Box<Build>,
    /// Confidence in the image, for algorithms that state it.
    confidence: Option<ImageConfidence>,
    /// Zero-mean prior, for algorithms that have one.
    prior: Option<Arc<Gaussian>>,
}

fn on_atoms(
    data: &TrainingData,
    weights: Weights,
    build: impl Fn(usize) -> Box<dyn Recover> + Send + Sync + 'static,
) -> Result<Box<dyn Trained>, Refusal> {
    Ok(Box::new(ImageDecoder {
        unknowns: Unknowns::Atoms(data.dictionary()?),
        weights,
        build: Box::new(build),
        confidence: None,
        prior: None,
    }))
}

fn on_taxels(recover: impl Recover + Clone + 'static) -> Result<Box<dyn Trained>, Refusal> {
    Ok(Box::new(taxels(recover)))
}

fn taxels(recover: impl Recover + Clone + 'static) -> ImageDecoder {
    ImageDecoder {
        unknowns: Unknowns::Taxels,
        weights: Weights::Signs,
        build: Box::new(move |_| Box::new(recover.clone())),
        confidence: None,
        prior: None,
    }
}

pub(super) fn script_s20(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_atoms(data, Weights::Script, |_| Box::new(ReferenceOmp::new(SCRIPT_ATOMS)))
}

pub(super) fn script_m4(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_atoms(data, Weights::Script, |m| Box::new(ReferenceOmp::new(quarter(m))))
}

pub(super) fn matched(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_atoms(data, Weights::Signs, |m| Box::new(ReferenceOmp::new(quarter(m))))
}

pub(super) fn omp(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_atoms(data, Weights::Signs, |m| Box::new(Omp::new(quarter(m))))
}

pub(super) fn nn_omp(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_atoms(data, Weights::Signs, |m| Box::new(NnOmp::new(quarter(m))))
}

pub(super) fn nn_lasso(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    let lasso = NnLasso::new(LASSO).map_err(|e| e.at("parameter"))?.with_normalised_columns();
    on_atoms(data, Weights::Signs, move |_| Box::new(lasso))
}

pub(super) fn lmmse(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_taxels(Lmmse::new(data.prior(ImagePrior::SEEN)?, NOISE).map_err(|e| e.at("parameter"))?)
}

pub(super) fn nn_lmmse(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    let prior = data.prior(ImagePrior::UNSEEN)?;
    let confidence = ImageConfidence::new(Arc::clone(&prior), NOISE).map_err(|e| e.at("prior"))?;
    Ok(Box::new(ImageDecoder {
        confidence: Some(confidence),
        prior: Some(Arc::clone(&prior)),
        ..taxels(NnLmmse::new(prior, NOISE).map_err(|e| e.at("parameter"))?)
    }))
}

pub(super) fn nn_lmmse_seen(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_taxels(NnLmmse::new(data.prior(ImagePrior::SEEN)?, NOISE).map_err(|e| e.at("parameter"))?)
}

pub(super) fn tv(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    on_taxels(Tv::new(data.shape[0], data.shape[1], VARIATION).map_err(|e| e.at("parameter"))?)
}

impl Trained for ImageDecoder {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(AtWork {
            decoder: self,
            recover: None,
            operator: Vec::new(),
            work: Workspace::default(),
            solution: Solution::default(),
        })
    }

    fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
        let confidence = self.confidence.clone()?;
        Some((Subject::Image, Box::new(confidence)))
    }

    fn prior(&self) -> Option<Arc<Gaussian>> {
        self.prior.clone()
    }
}

struct AtWork<'a> {
    decoder: &'a ImageDecoder,
    /// The algorithm for the M of the last window.
    recover: Option<(usize, Box<dyn Recover>)>,
    operator: Vec<f64>,
    work: Workspace,
    solution: Solution,
}

impl AtWork<'_> {
    /// Rows of Φ·D.
    fn project(&mut self, window: &Window<'_>, dictionary: &Dictionary) {
        let atoms = dictionary.sums.len();
        self.operator.resize(window.y.len() * atoms, 0.0);
        dictionary.project(window.phi, window.signs, &mut self.operator);
        if self.decoder.weights == Weights::Script {
            dictionary.to_unit_weights(&mut self.operator);
        }
    }
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        let m = window.y.len();
        let decoder = self.decoder;
        if decoder.weights == Weights::Script && !window.wires.is_empty() {
            return Err(Refusal::new("the published script is for one wire").into());
        }
        if let Unknowns::Atoms(dictionary) = &decoder.unknowns {
            self.project(window, dictionary);
        }
        let (_, recover) = match self.recover.take() {
            Some(built) if built.0 == m => self.recover.insert(built),
            _ => self.recover.insert((m, (decoder.build)(m))),
        };
        let y = match decoder.weights {
            Weights::Signs => window.y,
            Weights::Script => window.volts,
        };
        answer.class = None;
        answer.image.resize(window.phi.ncols(), 0.0);
        match &decoder.unknowns {
            Unknowns::Atoms(dictionary) => {
                let atoms = dictionary.sums.len();
                // as many numbers as rows times atoms, by `project`
                let a = MatrixView::new(m, atoms, &self.operator).unwrap_or(window.phi);
                recover.recover_into(&Problem::new(a, y)?, &mut self.work, &mut self.solution)?;
                self.solution.synthesise(dictionary.atoms.view(), &mut answer.image);
            }
            Unknowns::Taxels => {
                recover.recover_into(&Problem::new(window.phi, y)?, &mut self.work, &mut self.solution)?;
                self.solution.scatter(&mut answer.image);
            }
        }
        Ok(())
    }
}

/// Expected IoU of the linear estimate under the prior of a decoder, by its posterior covariance.
#[derive(Debug, Clone)]
pub(super) struct ImageConfidence {
    gains: SequentialGains,
    estimate: SequentialEstimate,
}

impl ImageConfidence {
    /// Confidence under `prior` for measurements with `noise`.
    ///
    /// # Errors
    /// [`Refusal`] when they do not go together.
    pub(super) fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, Refusal> {
        let gains = SequentialGains::new(prior, noise)?;
        let estimate = SequentialEstimate::new(&gains);
        Ok(Self { gains, estimate })
    }
}

impl Confidence for ImageConfidence {
    fn begin(&mut self) {
        self.gains.clear();
        self.estimate.clear();
    }

    fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
        self.gains.push(sample.phi.values())?;
        for y in sample.y {
            self.estimate.observe(&self.gains, *y)?;
        }
        Ok(Belief { confidence: self.estimate.expected_iou(&self.gains, SUPPORT_THRESHOLD), class: None })
    }
}
