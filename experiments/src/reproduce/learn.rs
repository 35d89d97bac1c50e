//! What the twin's decoder learns, from simulated raster images only.

use super::plan::Plan;
use crate::real::SHIFT_REACH;
use crate::score::{Learned, Session};
use rand::seq::SliceRandom as _;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::dictionary::{Ksvd, Selection, select, shifted};

/// Frames of a press that dictionary learning looks at: the rise, the plateau and the lift.
const TRAINING_FRAMES: std::ops::Range<usize> = 250..800;
/// Every how manieth of them.
const TRAINING_STRIDE: usize = 10;
/// Plateau frames that enter the classifier's library.
const LIBRARY_FRAMES: std::ops::Range<usize> = 500..650;
/// Library images of an object, as in the published library.
const LIBRARY_IMAGES: usize = 10;

/// A dictionary or library that could not be learned.
#[derive(Debug, thiserror::Error)]
pub(super) enum LearnError {
    /// K-SVD has nothing to work on.
    #[error("dictionary: {0}")]
    Ksvd(#[from] spts_recon::dictionary::KsvdError),
    /// The library is empty.
    #[error("library: {0}")]
    Library(#[from] spts_recon::classify::LibraryError),
}

/// Learns K-SVD dictionary (published preprocessing) and library from the raster sessions.
///
/// # Errors
/// [`LearnError`] when no raster image is strong enough to learn from.
pub(super) fn learn(sessions: &[Session], plan: &Plan, cols: usize, streams: Streams) -> Result<Learned, LearnError> {
    let mut candidates = training_images(sessions, plan);
    // the limit on their number then treats all objects, presses and frames alike
    candidates.shuffle(&mut streams.rng("training", 0));
    let selection = Selection {
        max_images: plan.training_images,
        ..Selection::default()
    };
    let chosen: Vec<Vec<f64>> = select(&candidates, &selection)
        .into_iter()
        .map(|i| candidates[i].clone())
        .collect();
    let ksvd = Ksvd {
        n_iter: plan.sweeps,
        ..Ksvd::default()
    };
    let dictionary = ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))?;
    let all_places = shifted(&dictionary, cols, SHIFT_REACH);
    Ok(Learned::new(dictionary, all_places, library(sessions, plan)?))
}

/// Raster images of all objects.
fn training_images(sessions: &[Session], plan: &Plan) -> Vec<Vec<f64>> {
    let mut images = Vec::new();
    for press in plan.learned_presses.clone() {
        for frame in TRAINING_FRAMES.step_by(TRAINING_STRIDE) {
            for raster in sessions.iter().map(|s| &s.raster) {
                if press < raster.blocks().len() && frame < raster.frames() {
                    images.push(raster.volts(press, frame).to_vec());
                }
            }
        }
    }
    images
}

/// Ten plateau images of every object, spread evenly over the presses learned from.
fn library(sessions: &[Session], plan: &Plan) -> Result<Library, LearnError> {
    let (mut images, mut labels): (Vec<&[f64]>, Vec<usize>) = (Vec::new(), Vec::new());
    for session in sessions {
        let last = session.raster.blocks().len().min(plan.learned_presses.end);
        let presses: Vec<usize> = (plan.learned_presses.start..last).collect();
        for k in 0..LIBRARY_IMAGES {
            let Some(&press) = presses.get(k % presses.len().max(1)) else {
                break;
            };
            let frame = LIBRARY_FRAMES.start + k * LIBRARY_FRAMES.len() / LIBRARY_IMAGES;
            images.push(session.raster.volts(press, frame.min(session.raster.frames() - 1)));
            labels.push(session.label);
        }
    }
    let taxels = sessions.first().map_or(0, |s| s.raster.taxels());
    Ok(Library::new(&Matrix::from_column_slices(taxels, &images), &labels)?)
}
