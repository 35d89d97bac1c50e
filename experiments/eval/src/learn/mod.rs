//! What decoders learn from raster images, and simulated ones to learn from.

mod gains;
mod layout;
mod lessons;
mod skins;
mod training;

pub use gains::{GainMap, GainMapError};
pub use lessons::{Dictionary, LearnError, Lessons};
pub use skins::{Skins, SkinsError};

pub use training::{TrainingPresses, library, prior_images, templates, training_images};

use crate::score::{Learned, ScoredSession};
use rand::seq::SliceRandom as _;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::dictionary::{DictionaryError, Ksvd, Selection, select, shifted};
use std::ops::Range;

/// Reach of the shifted dictionary when none is published, taxels.
pub const SHIFT_REACH: usize = 2;

/// How much the published decoder learns from.
#[derive(Debug, Clone)]
pub struct Learning {
    /// Raster presses of every object that are learned from.
    pub presses: Range<usize>,
    /// Most training images of the dictionary.
    pub training_images: usize,
    /// Sweeps of the dictionary learning.
    pub sweeps: usize,
}

/// Learns K-SVD dictionary (published preprocessing) and library from the raster sessions.
///
/// # Errors
/// [`LearnError`] when no raster image is strong enough to learn from.
pub fn learn(
    sessions: &[ScoredSession],
    learning: &Learning,
    cols: usize,
    streams: Streams,
) -> Result<Learned, LearnError> {
    let training: Vec<TrainingPresses<'_>> = sessions
        .iter()
        .filter_map(|s| TrainingPresses::within(s, &learning.presses))
        .collect();
    let selection = Selection {
        max_images: learning.training_images,
        ..Selection::default()
    };
    let ksvd = Ksvd {
        n_iter: learning.sweeps,
        ..Ksvd::default()
    };
    let dictionary = learn_dictionary(training_images(&training), &selection, &ksvd, streams)?;
    let all_places = shifted(&dictionary, cols, SHIFT_REACH);
    Ok(Learned::new(dictionary, all_places, library(&training)?))
}

/// K-SVD on what `selection` keeps of the `candidates`.
fn learn_dictionary(
    mut candidates: Vec<Vec<f64>>,
    selection: &Selection,
    ksvd: &Ksvd,
    streams: Streams,
) -> Result<Matrix, DictionaryError> {
    // the limit on their number then treats all objects, presses and frames alike
    candidates.shuffle(&mut streams.rng("training", 0));
    let chosen: Vec<Vec<f64>> = select(&candidates, selection)
        .into_iter()
        .map(|i| candidates[i].clone())
        .collect();
    ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))
}
