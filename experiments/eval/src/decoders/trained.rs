//! A trained decoder.

use super::DecoderSpec;
use crate::algorithm::Trained;
use crate::training::{LearnError, TrainingData};
use spts_recon::classify::Src;
use std::sync::Arc;

/// A trained algorithm, with an image classifier for algorithms that find no class themselves.
#[derive(Clone)]
pub struct TrainedDecoder {
    pub(crate) trained: Arc<dyn Trained>,
    pub(crate) classifier: Arc<Src>,
}

impl TrainedDecoder {
    /// Trains the algorithm `spec` with `data`.
    ///
    /// # Errors
    /// [`LearnError`] if `data` is not usable.
    pub fn new(spec: &DecoderSpec, data: &TrainingData) -> Result<Self, LearnError> {
        Ok(Self::of(Arc::from((spec.train)(data)?), data))
    }

    /// `trained`, which has learned from `data`.
    pub(crate) fn of(trained: Arc<dyn Trained>, data: &TrainingData) -> Self {
        let classifier = Src::new(data.library.clone(), Src::PUBLISHED_SPARSITY);
        Self {
            trained,
            classifier: Arc::new(classifier),
        }
    }
}
