//! What a recording says of itself.

use crate::converter::Converter;
use crate::mode::{Mode, WeightMode};
use crate::recording_error::RecordingError;
use crate::weights::Weights;
use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// What a recording says of itself, beside its samples: all that a decoder needs to know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingInfo {
    /// Skin that was recorded.
    pub layout: SkinLayout,
    /// Weights that its cells were meant to put out, as many as there are taxels. They also say which readout it is:
    /// raster weights are those of a raster scan.
    pub weights: Weights,
    /// Measurements a second, Hz. Range (0, ∞).
    pub sample_rate_hz: f64,
    /// Measurements in a frame. Range [1, ∞); 100 in the published recordings.
    pub measurements_per_frame: usize,
    /// Scale of the converter; none when no converter acted, or when its scale is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub converter: Option<Converter>,
}

impl RecordingInfo {
    /// Information on a skin that is read out with as many measurements a frame as it has taxels and without a
    /// converter.
    #[must_use]
    pub fn new(layout: SkinLayout, weights: Weights, sample_rate_hz: f64) -> Self {
        Self {
            measurements_per_frame: layout.taxels(),
            layout,
            weights,
            sample_rate_hz,
            converter: None,
        }
    }

    /// Which readout this is.
    #[must_use]
    pub fn mode(&self) -> Mode {
        match self.weights.mode() {
            WeightMode::Raster => Mode::Raster,
            WeightMode::Analog | WeightMode::Binary => Mode::Compressive,
        }
    }

    /// Checks what does not depend on the samples.
    pub(crate) fn check(&self) -> Result<(), RecordingError> {
        if self.measurements_per_frame == 0 {
            return Err(RecordingError::Empty {
                field: "measurements_per_frame",
            });
        }
        if self.weights.taxels() != self.layout.taxels() {
            return Err(RecordingError::Taxels {
                weights: self.weights.taxels(),
                layout: self.layout.taxels(),
            });
        }
        let value = self.sample_rate_hz;
        (value > 0.0 && value.is_finite())
            .then_some(())
            .ok_or(RecordingError::SampleRate { value })
    }
}
