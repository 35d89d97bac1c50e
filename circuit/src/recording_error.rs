//! Errors of recordings.

/// Why data do not form a valid recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A dimension is zero.
    #[error("`{field}` = 0 is outside [1, ∞)")]
    Empty {
        /// Name of the dimension.
        field: &'static str,
    },
    /// The sample rate is not a positive number.
    #[error("`sample_rate_hz` = {value} is outside (0, ∞)")]
    SampleRate {
        /// The value, Hz.
        value: f64,
    },
    /// A block whose length differs from the first one, or is not a whole number of frames.
    #[error("block {block} has {len} samples; expected {frames} frames of {measurements}")]
    BlockLength {
        /// 0-based block.
        block: usize,
        /// Number of its samples.
        len: usize,
        /// Frames a block.
        frames: usize,
        /// Measurements a frame.
        measurements: usize,
    },
    /// A block that would begin before the seeds were loaded.
    #[error(
        "block {block} has `frame_position` = {frame_position}, outside [{frames}, ∞): the block is {frames} frames long"
    )]
    FramePosition {
        /// 0-based block.
        block: usize,
        /// Its frame position.
        frame_position: u64,
        /// Frames a block.
        frames: usize,
    },
    /// A block so late that the number of its last weight row exceeds 64 bits.
    #[error("block {block} has `frame_position` = {frame_position}, outside [{frames}, {limit}]")]
    RowCount {
        /// 0-based block.
        block: usize,
        /// Its frame position.
        frame_position: u64,
        /// Frames a block.
        frames: usize,
        /// Largest frame position for this number of measurements a frame.
        limit: u64,
    },
    /// A block that is idle for longer than it lasts.
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
    #[error("block {block}, sample {sample} = {value} V is not finite; NaN marks a lost sample")]
    Infinite {
        /// 0-based block.
        block: usize,
        /// 0-based sample within the block.
        sample: usize,
        /// The value.
        value: f64,
    },
}
