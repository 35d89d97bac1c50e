//! What the twin's decoder learns, from simulated raster images only.

use crate::calibrate::PLATEAU;
use crate::real::SHIFT_REACH;
use crate::score::{Learned, Session};
use rand::seq::SliceRandom as _;
use spts_circuit::Recording;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::dictionary::{Ksvd, Learner as _, Selection, select, shifted};
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
pub(crate) struct Learning {
    /// Raster presses of every object that are learned from.
    pub(crate) presses: Range<usize>,
    /// Most training images of the dictionary.
    pub(crate) training_images: usize,
    /// Sweeps of the dictionary learning.
    pub(crate) sweeps: usize,
}

/// A dictionary or library that could not be learned.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LearnError {
    /// K-SVD has nothing to work on.
    #[error("dictionary: {0}")]
    Ksvd(#[from] spts_recon::dictionary::DictionaryError),
    /// The library is empty.
    #[error("library: {0}")]
    Library(#[from] spts_recon::classify::LibraryError),
}

/// Learns K-SVD dictionary (published preprocessing) and library from the raster sessions.
///
/// # Errors
/// [`LearnError`] when no raster image is strong enough to learn from.
pub(crate) fn learn(
    sessions: &[Session],
    learning: &Learning,
    cols: usize,
    streams: Streams,
) -> Result<Learned, LearnError> {
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
    for press in learning.presses.clone() {
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
