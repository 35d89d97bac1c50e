//! Confidence in an image, sample by sample.

use crate::algorithm::{Belief, Confidence, DecodeError};
use crate::windows::Window;
use spts_input::Refusal;
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::{Gaussian, Noise, SequentialEstimate, SequentialGains};
use std::sync::Arc;

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
        Ok(Belief {
            confidence: self.estimate.expected_iou(&self.gains, SUPPORT_THRESHOLD),
            class: None,
        })
    }
}
