//! A decoder that has learned.

use super::DecoderSpec;
use crate::algorithm::Trained;
use crate::training::{LearnError, TrainingData};
use spts_recon::classify::Src;
use std::sync::Arc;

/// An algorithm that has learned what it needs, with the classifier of the images of algorithms that say no class.
#[derive(Clone)]
pub struct TrainedDecoder {
    pub(crate) trained: Arc<dyn Trained>,
    pub(crate) classifier: Arc<Src>,
}

impl TrainedDecoder {
    /// The algorithm `spec` after it has learned from `data`.
    ///
    /// # Errors
    /// [`LearnError`] when it cannot learn from them.
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
