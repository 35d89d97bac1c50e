//! Training results of the published decoder: a dictionary and a library.

use super::dictionary::{Dictionary, Learning, learn_dictionary};
use super::error::{LearnError, in_dictionary, in_library};
use super::presses::{TrainingPresses, library, training_images};
use crate::session::ScoredSession;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::{Library, Src};
use spts_recon::dictionary::shifted;
use std::sync::Arc;

/// Reach of the shifted dictionary if none is published, taxels.
pub const SHIFT_REACH: usize = 2;

/// What the published decoder has learned from raster presses: dictionary and classifier.
#[derive(Debug, Clone)]
pub struct Learned {
    /// Dictionary.
    pub dictionary: Arc<Dictionary>,
    /// The dictionary with shifted copies, for contacts at untrained places, taxels × atoms.
    pub shifted: Matrix,
    /// Classifier.
    pub classifier: Arc<Src>,
    /// Columns of the array.
    pub cols: usize,
}

impl Learned {
    /// Combines a dictionary (taxels × atoms), its shifted copies (computed if not given) and a library, for an array
    /// with `cols` columns.
    #[must_use]
    pub fn new(dictionary: Matrix, shifted_copies: Option<Matrix>, library: Library, cols: usize) -> Self {
        Self {
            shifted: shifted_copies.unwrap_or_else(|| shifted(&dictionary, cols, SHIFT_REACH)),
            dictionary: Arc::new(Dictionary::new(dictionary)),
            classifier: Arc::new(Src::new(library, Src::PUBLISHED_SPARSITY)),
            cols,
        }
    }

    /// Learns a dictionary by K-SVD (published preprocessing) and a library from the raster recordings of `sessions`,
    /// for an array with `cols` columns.
    ///
    /// # Errors
    /// [`LearnError`] if no raster image is strong enough.
    pub fn learn(
        sessions: &[ScoredSession],
        learning: &Learning,
        cols: usize,
        streams: Streams,
    ) -> Result<Self, LearnError> {
        let training: Vec<TrainingPresses<'_>> = sessions
            .iter()
            .filter_map(|s| TrainingPresses::within(s, &learning.presses))
            .collect();
        let dictionary =
            learn_dictionary(training_images(&training), &learning.dictionary(), streams).map_err(in_dictionary)?;
        Ok(Self::new(
            dictionary,
            None,
            library(&training).map_err(in_library)?,
            cols,
        ))
    }

    /// The same with the shifted dictionary in place of the dictionary.
    #[must_use]
    pub fn at_all_places(&self) -> Self {
        Self {
            dictionary: Arc::new(Dictionary::new(self.shifted.clone())),
            ..self.clone()
        }
    }
}
