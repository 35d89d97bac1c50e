//! What keeps a block from being acquired.

use crate::codes::CodesError;
use crate::recording_error::RecordingError;

/// A block that cannot be acquired.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AcquireError {
    /// A source of another skin.
    #[error("the source has {source_taxels} taxels; the readout {taxels}")]
    Taxels {
        /// Taxels of the source.
        source_taxels: usize,
        /// Taxels of the readout.
        taxels: usize,
    },
    /// Nothing, or a broken frame.
    #[error("{measurements} measurements are not a positive whole number of frames of {frame}")]
    PartialFrame {
        /// Measurements asked for.
        measurements: usize,
        /// Measurements a frame.
        frame: usize,
    },
    /// A source that hands out a segment which does not hold the time asked for, or one of another skin.
    #[error("at {time_s} s the source gives {taxels} taxels from {start_s} s to {end_s} s")]
    Segment {
        /// Time asked for, s since the start of the block.
        time_s: f64,
        /// Start of the segment, s.
        start_s: f64,
        /// End of the segment, s.
        end_s: f64,
        /// Taxels of the segment.
        taxels: usize,
    },
    /// Cells that put out nothing, or those of another skin.
    #[error("cells: {0}")]
    Codes(#[from] CodesError),
    /// Blocks that do not make a recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
