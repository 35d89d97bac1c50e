//! The evidence classifier learned from raster presses that are not scored.

use super::protocol::Protocol;
use super::synthetic::synthetic_windows;
use crate::learn::{Taught, templates};
use spts::Session;
use spts_models::Streams;
use spts_recon::classify::{
    EvidenceClassifier, EvidenceError, ImageEstimator, Library, LibraryError, Posterior, TemplateModel, fit_temperature,
};
use spts_recon::recover::ParameterError;
use spts_recon::{AmplitudeRange, Matrix, MatrixView};

/// Amplitudes of a press that count as possible, V at the strongest taxel: sessions of one object differ by .50–1.38, objects by
/// .4–1.7.
pub const AMPLITUDES_V: [f64; 2] = [0.2, 6.0];

/// Prior probability of an object that is in no class: about that of every class. On windows made from raster images it takes about 1 % of
/// the known objects at M = 13 and 20.
const UNKNOWN_PRIOR: f64 = 0.05;

/// Noise of a measurement that images are made with, as a share of the strongest taxel: 5–7 % of the image's length, which is 3–4 times
/// the strongest taxel.
pub const IMAGE_NOISE: f64 = 0.2;

/// Numbers of measurements, and windows an object each, that the temperature is fitted on.
const CALIBRATED_ON: ([usize; 3], usize) = ([7, 13, 20], 30);

/// Seed of these windows.
const CALIBRATION_SEED: u64 = 1;

/// Why no evidence classifier could be learned.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceLearnError {
    /// No session has a press to learn from.
    #[error("templates: {0}")]
    Library(#[from] LibraryError),
    /// The templates make no classifier.
    #[error("evidence: {0}")]
    Evidence(#[from] EvidenceError),
    /// The templates make no images.
    #[error("images: {0}")]
    Images(#[from] ParameterError),
    /// The range of amplitudes is not one.
    #[error("amplitude: {0}")]
    Amplitude(#[from] spts_recon::RangeError),
}

/// What an evidence classifier is learned for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EvidenceTask<'a> {
    /// Makes anything that is in no class an outcome too, which costs some of the presses that differ most from their templates.
    pub unknown: bool,
    /// Object that is not learned.
    pub left_out: Option<&'a str>,
    /// Every template is also expected moved by up to this many taxels.
    pub reach: usize,
    /// Rows and columns that the templates are moved by, zeros moving in: a library of another place.
    pub moved: [isize; 2],
}

/// An evidence classifier and what makes its images.
#[derive(Debug, Clone)]
pub struct LearnedEvidence {
    /// The classifier, calibrated.
    pub classifier: EvidenceClassifier,
    /// Images of its decisions.
    pub images: ImageEstimator,
}

/// Classifier by the templates of `sessions` for `task`; like every other decoder's for these classes only, unless anything else is to be an
/// outcome too.
///
/// # Errors
/// [`EvidenceLearnError`] when there is nothing to learn from, or the images do not fill a grid of `cols` columns.
pub fn learn_evidence(
    task: &EvidenceTask<'_>,
    sessions: &[Session],
    protocol: &Protocol,
    cols: usize,
) -> Result<LearnedEvidence, EvidenceLearnError> {
    let learned: Vec<&Session> = sessions
        .iter()
        .filter(|s| task.left_out != Some(s.object.as_str()))
        .collect();
    let taught: Vec<Taught<'_>> = learned.iter().map(|s| Taught::unscored(s, protocol)).collect();
    let library = moved(&templates(&taught)?, cols, task.moved)?;
    let model = TemplateModel {
        reach: task.reach,
        ..if task.unknown {
            TemplateModel::open(cols)
        } else {
            TemplateModel::new(cols)
        }
    };
    let (mut components, mut priors) = (model.classes(&library)?, model.image_priors(&library)?);
    if task.unknown {
        components.push(model.unknown(&library)?);
        priors.push(model.unknown_prior(&library)?);
    }
    let amplitude = AmplitudeRange::new(AMPLITUDES_V[0], AMPLITUDES_V[1])?;
    let classifier = EvidenceClassifier::new(&components, amplitude, UNKNOWN_PRIOR)?;
    // moved templates would be calibrated on objects that are elsewhere
    let temperature = if task.moved == [0, 0] {
        temperature(&classifier, &learned, protocol, cols)?
    } else {
        1.0
    };
    Ok(LearnedEvidence {
        classifier: classifier.with_temperature(temperature)?,
        images: ImageEstimator::new(priors, IMAGE_NOISE)?,
    })
}

/// The library with all images moved by so many rows and columns.
fn moved(library: &Library, cols: usize, by: [isize; 2]) -> Result<Library, LibraryError> {
    let images = library.images();
    let (cols, mut out) = (cols.max(1), Matrix::zeros(images.nrows(), images.ncols()));
    for i in 0..images.nrows() {
        let (row, col) = (
            (i / cols).checked_add_signed(by[0]),
            (i % cols).checked_add_signed(by[1]),
        );
        if let (Some(row), Some(col)) = (row, col.filter(|c| *c < cols))
            && row * cols + col < images.nrows()
        {
            out.row_mut(row * cols + col).copy_from_slice(images.row(i));
        }
    }
    Library::new(&out, library.labels())
}

/// Temperature for windows made from the raster images of `sessions`; 1 without any.
fn temperature(
    classifier: &EvidenceClassifier,
    sessions: &[&Session],
    protocol: &Protocol,
    cols: usize,
) -> Result<f64, EvidenceError> {
    let streams = Streams::new(CALIBRATION_SEED);
    let (numbers, count) = CALIBRATED_ON;
    let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
    let (mut posterior, mut row) = (Posterior::default(), vec![0.0; classifier.bank().ncols()]);
    let (mut rows, mut truth) = (Vec::new(), Vec::new());
    for m in numbers {
        for session in sessions {
            let Some(outcome) = classifier.outcomes().iter().position(|o| *o == Some(session.label)) else {
                continue;
            };
            for window in synthetic_windows(
                session,
                protocol,
                cols,
                m,
                count,
                streams.child("measurements", m as u64),
            ) {
                preparation.clear();
                evidence.clear();
                let weights = window.weights.chunks_exact(classifier.bank().nrows());
                for (weights, &y) in weights.zip(&window.y) {
                    row.fill(0.0);
                    classifier.bank().accumulate_row(weights, &mut row);
                    preparation.push(&row)?;
                    evidence.observe(&preparation, y)?;
                }
                classifier.decide(&preparation, &evidence, &mut posterior);
                rows.extend_from_slice(&posterior.log_evidence);
                truth.push(outcome);
            }
        }
    }
    match MatrixView::new(truth.len(), classifier.outcomes().len(), &rows) {
        Ok(evidence) if !truth.is_empty() => fit_temperature(evidence, &truth),
        _ => Ok(1.0),
    }
}
