//! Errors of acquiring a block.

use crate::codes::CodesError;
use crate::recording_error::RecordingError;

/// Why a block cannot be acquired.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AcquireError {
    /// The source belongs to another skin.
    #[error("the source has {source_taxels} taxels; the readout {taxels}")]
    Taxels {
        /// Taxels of the source.
        source_taxels: usize,
        /// Taxels of the readout.
        taxels: usize,
    },
    /// The number of measurements is zero, or not a whole number of frames.
    #[error("{measurements} measurements are not a positive whole number of frames of {frame}")]
    PartialFrame {
        /// Measurements asked for.
        measurements: usize,
        /// Measurements a frame.
        frame: usize,
    },
    /// The source returned a segment that does not contain the requested time, or belongs to another skin.
    #[error("at {time_s} s the source gives {taxels} taxels from {start_s} s to {end_s} s")]
    Segment {
        /// Requested time, s since the start of the block.
        time_s: f64,
        /// Start of the segment, s.
        start_s: f64,
        /// End of the segment, s.
        end_s: f64,
        /// Taxels of the segment.
        taxels: usize,
    },
    /// The cells have no codes, or belong to another skin.
    #[error("cells: {0}")]
    Codes(#[from] CodesError),
    /// The blocks do not form a valid recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
