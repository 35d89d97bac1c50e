//! What makes a recording unusable.

/// A recording that contradicts itself.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A shape of nothing.
    #[error("`{field}` = 0 is outside [1, ∞)")]
    Empty {
        /// Which number is zero.
        field: &'static str,
    },
    /// Not a frequency.
    #[error("`sample_rate_hz` = {value} is outside (0, ∞)")]
    SampleRate {
        /// Offending value, Hz.
        value: f64,
    },
    /// A block of another length than the first one, or not a whole number of frames.
    #[error("block {block} has {len} samples; expected {frames} frames of {measurements}")]
    BlockLength {
        /// 0-based block.
        block: usize,
        /// Its samples.
        len: usize,
        /// Frames a block.
        frames: usize,
        /// Measurements a frame.
        measurements: usize,
    },
    /// A block that would have begun before the seeds were loaded.
    #[error("block {block} ends at frame {frame_position} but is {frames} frames long")]
    FramePosition {
        /// 0-based block.
        block: usize,
        /// Its position.
        frame_position: u64,
        /// Frames a block.
        frames: usize,
    },
    /// A block so late that the number of its last row of weights does not fit into 64 bits.
    #[error("block {block} has `frame_position` = {frame_position}, outside [{frames}, {limit}]")]
    RowCount {
        /// 0-based block.
        block: usize,
        /// Its position.
        frame_position: u64,
        /// Frames a block.
        frames: usize,
        /// Largest position with as many measurements a frame.
        limit: u64,
    },
    /// A block that is idle for longer than it is.
    #[error("block {block} has `idle_frames` = {idle_frames}, outside [0, {frames}]")]
    IdleFrames {
        /// 0-based block.
        block: usize,
        /// Its idle frames.
        idle_frames: usize,
        /// Frames a block.
        frames: usize,
    },
    /// Weights of another skin.
    #[error("`weights` are those of {weights} taxels; `layout` has {layout}")]
    Taxels {
        /// Taxels of the weights.
        weights: usize,
        /// Taxels of the layout.
        layout: usize,
    },
    /// An infinite sample.
    #[error("block {block}, sample {sample} is {value}")]
    Infinite {
        /// 0-based block.
        block: usize,
        /// 0-based sample within the block.
        sample: usize,
        /// Offending value.
        value: f64,
    },
}
