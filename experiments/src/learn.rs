//! What decoders learn from raster images, and simulated ones to learn from.

mod gains;
mod skins;

pub use gains::{GainMap, GainMapError};
pub use skins::{Skins, SkinsError};

use crate::calibrate::PLATEAU;
use crate::real::SHIFT_REACH;
use crate::score::{Learned, Session};
use rand::seq::SliceRandom as _;
use spts_circuit::Recording;
use spts_models::Streams;
use spts_recon::classify::{EvidenceClassifier, Library, LibraryError, TemplateModel};
use spts_recon::dictionary::{Ksvd, Learner as _, Selection, select, shifted};
use spts_recon::{AmplitudeRange, Matrix};
use std::ops::Range;

/// Taxels of the published skin, in whose frames the instants below are counted: a larger skin has fewer frames in the same
/// time.
pub(crate) const PUBLISHED_TAXELS: usize = 100;
/// Frames of a press that dictionary learning looks at: the rise, the plateau and the lift.
const TRAINING_FRAMES: Range<usize> = 250..800;
/// Every how manieth of them.
const TRAINING_STRIDE: usize = 10;
/// Plateau frames that enter the classifier's library.
const LIBRARY_FRAMES: Range<usize> = PLATEAU;
/// Library images of an object, as in the published library.
const LIBRARY_IMAGES: usize = 10;

/// How much is learned from.
#[derive(Debug, Clone)]
pub struct Learning {
    /// Raster presses of every object that are learned from.
    pub presses: Range<usize>,
    /// Most training images of the dictionary.
    pub training_images: usize,
    /// Sweeps of the dictionary learning.
    pub sweeps: usize,
}

/// A dictionary or library that could not be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// K-SVD has nothing to work on.
    #[error("dictionary: {0}")]
    Ksvd(#[from] spts_recon::dictionary::DictionaryError),
    /// The library is empty.
    #[error("library: {0}")]
    Library(#[from] spts_recon::classify::LibraryError),
    /// The templates make no classifier.
    #[error("templates: {0}")]
    Evidence(#[from] spts_recon::classify::EvidenceError),
}

/// What decoders know before the first compressive measurement.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// Dictionary and the library of the classifier by images.
    pub learned: Learned,
    /// Images for priors, taxels × images.
    pub images: Matrix,
    /// Classifier by evidence.
    pub evidence: EvidenceClassifier,
}

/// Frames of a press that a prior is learned from: early, middle and late on the plateau.
const PRIOR_FRAMES: [usize; 3] = [520, 580, 640];

/// Learns everything from the presses `learning` names of the raster sessions, real or simulated. The classifier's templates are the mean
/// images and vary as `model` says: with [`Skins::gain_sd`] or [`GainMap::gain_sd`] in [`TemplateModel::gain`], and some twenty
/// eigenvectors, they suit a skin that is none of those learned from. `amplitude` is the range of a contact's strongest taxel, V.
///
/// # Errors
/// [`LearnError`] when there is nothing to learn from, or `model` is out of its range.
pub fn learn_from(
    sessions: &[Session],
    learning: &Learning,
    model: &TemplateModel,
    amplitude: AmplitudeRange,
    streams: Streams,
) -> Result<Knowledge, LearnError> {
    Ok(Knowledge {
        learned: learn(sessions, learning, model.cols, streams)?,
        images: prior_images(sessions, learning),
        evidence: learn_classifier(sessions, learning, model, amplitude)?,
    })
}

/// The classifier by evidence of [`learn_from`] alone.
///
/// # Errors
/// As for [`learn_from`].
pub fn learn_classifier(
    sessions: &[Session],
    learning: &Learning,
    model: &TemplateModel,
    amplitude: AmplitudeRange,
) -> Result<EvidenceClassifier, LearnError> {
    let components = model.classes(&mean_images(sessions, learning)?)?;
    Ok(EvidenceClassifier::new(&components, amplitude, UNKNOWN_PRIOR)?)
}

/// Prior probability of an object that is in no class; the components above are all of classes.
const UNKNOWN_PRIOR: f64 = 0.01;

/// Presses of `raster` that are learned from.
fn presses_of(raster: &Recording, learning: &Learning) -> Range<usize> {
    let end = learning.presses.end.min(raster.blocks().len());
    learning.presses.start.min(end)..end
}

/// One image an object: the mean over the plateau of the presses that are learned from, negative values set to zero.
///
/// # Errors
/// [`LibraryError`] when no image is different from zero.
pub fn mean_images(sessions: &[Session], learning: &Learning) -> Result<Library, LibraryError> {
    let (mut images, mut labels) = (Vec::new(), Vec::new());
    for session in sessions {
        let raster = &session.raster;
        let (mut image, mut count) = (vec![0.0; raster.taxels()], 0.0);
        for press in presses_of(raster, learning) {
            for frame in LIBRARY_FRAMES {
                let volts = raster.volts(press, own_frame(raster, frame).min(raster.frames() - 1));
                image.iter_mut().zip(volts).for_each(|(sum, v)| *sum += v.max(0.0));
                count += 1.0;
            }
        }
        image.iter_mut().for_each(|v| *v /= f64::max(count, 1.0));
        images.push(image);
        labels.push(session.label);
    }
    let taxels = sessions.first().map_or(0, |s| s.raster.taxels());
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    Library::new(&Matrix::from_column_slices(taxels, &slices), &labels)
}

/// Images for priors, taxels × images.
fn prior_images(sessions: &[Session], learning: &Learning) -> Matrix {
    let mut columns: Vec<&[f64]> = Vec::new();
    for raster in sessions.iter().map(|s| &s.raster) {
        for press in presses_of(raster, learning) {
            let frame = |f| own_frame(raster, f).min(raster.frames() - 1);
            columns.extend(PRIOR_FRAMES.iter().map(|&f| raster.volts(press, frame(f))));
        }
    }
    Matrix::from_column_slices(sessions.first().map_or(0, |s| s.raster.taxels()), &columns)
}

/// Learns K-SVD dictionary (published preprocessing) and library from the raster sessions.
///
/// # Errors
/// [`LearnError`] when no raster image is strong enough to learn from.
pub fn learn(sessions: &[Session], learning: &Learning, cols: usize, streams: Streams) -> Result<Learned, LearnError> {
    let mut candidates = training_images(sessions, learning);
    // the limit on their number then treats all objects, presses and frames alike
    candidates.shuffle(&mut streams.rng("training", 0));
    let selection = Selection {
        max_images: learning.training_images,
        ..Selection::default()
    };
    let chosen: Vec<Vec<f64>> = select(&candidates, &selection)
        .into_iter()
        .map(|i| candidates[i].clone())
        .collect();
    let ksvd = Ksvd {
        n_iter: learning.sweeps,
        ..Ksvd::default()
    };
    let dictionary = ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))?;
    let all_places = shifted(&dictionary, cols, SHIFT_REACH);
    Ok(Learned::new(dictionary, all_places, library(sessions, learning)?))
}

/// Frame of `raster` at the instant of `frame` of a recording of the published skin.
fn own_frame(raster: &Recording, frame: usize) -> usize {
    frame * PUBLISHED_TAXELS / raster.measurements_per_frame()
}

/// Raster images of all objects.
fn training_images(sessions: &[Session], learning: &Learning) -> Vec<Vec<f64>> {
    let mut images = Vec::new();
    let most = sessions.iter().map(|s| s.raster.blocks().len()).max().unwrap_or(0);
    for press in learning.presses.start..learning.presses.end.min(most) {
        for frame in TRAINING_FRAMES.step_by(TRAINING_STRIDE) {
            for raster in sessions.iter().map(|s| &s.raster) {
                let frame = own_frame(raster, frame);
                if press < raster.blocks().len() && frame < raster.frames() {
                    images.push(raster.volts(press, frame).to_vec());
                }
            }
        }
    }
    images
}

/// Ten plateau images of every object, spread evenly over the presses learned from.
fn library(sessions: &[Session], learning: &Learning) -> Result<Library, LearnError> {
    let (mut images, mut labels): (Vec<&[f64]>, Vec<usize>) = (Vec::new(), Vec::new());
    for session in sessions {
        let last = session.raster.blocks().len().min(learning.presses.end);
        let presses: Vec<usize> = (learning.presses.start..last).collect();
        for k in 0..LIBRARY_IMAGES {
            let Some(&press) = presses.get(k % presses.len().max(1)) else {
                break;
            };
            let frame = LIBRARY_FRAMES.start + k * LIBRARY_FRAMES.len() / LIBRARY_IMAGES;
            images.push(session.raster.volts(
                press,
                own_frame(&session.raster, frame).min(session.raster.frames() - 1),
            ));
            labels.push(session.label);
        }
    }
    let taxels = sessions.first().map_or(0, |s| s.raster.taxels());
    Ok(Library::new(&Matrix::from_column_slices(taxels, &images), &labels)?)
}
