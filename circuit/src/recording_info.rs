//! Metadata of a recording.

use crate::converter::Converter;
use crate::mode::{Mode, WeightMode};
use crate::recording_error::RecordingError;
use crate::weights::Weights;
use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// Metadata of a recording: everything that a decoder needs beside the samples.
///
/// ```
/// use spts_circuit::{Mode, RecordingInfo, Seeding, WeightMode, Weights};
/// use spts_models::SkinLayout;
///
/// let weights = Weights::new(WeightMode::Raster, Seeding::Address, 100);
/// let info = RecordingInfo::new(SkinLayout::default(), weights, 64_300.0);
/// assert_eq!((info.mode(), info.measurements_per_frame), (Mode::Raster, 100));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingInfo {
    /// Layout of the recorded skin.
    pub layout: SkinLayout,
    /// Weights that the cells were meant to put out, one for each taxel. They also determine the readout: raster
    /// weights mean a raster scan.
    pub weights: Weights,
    /// Measurements a second, Hz. Range (0, ∞).
    pub sample_rate_hz: f64,
    /// Measurements in a frame. Range [1, ∞); 100 in the published recordings.
    pub measurements_per_frame: usize,
    /// Scale of the converter; `None` if no converter acted or its scale is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub converter: Option<Converter>,
}

impl RecordingInfo {
    /// Metadata of a skin whose frames have one measurement for each taxel, without a converter.
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

    /// The readout that made the recording.
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
