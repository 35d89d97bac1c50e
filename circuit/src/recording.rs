//! The seam between a skin, real or simulated, and everything that decodes it.

use serde::{Deserialize, Serialize};

/// Which of the two readouts a recording holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// One taxel a measurement, in row-major order.
    Raster,
    /// All taxels at once, with pseudorandom weights.
    Compressive,
}

/// One press: an unbroken run of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Frames since the seeds were loaded, at the END of the block.
    pub frame_position: u64,
    /// Output of the summing amplifier, sign-flipped, V; measurement `m` of frame `f` is entry
    /// `f · measurements_per_frame + m`. NaN where the instrument lost a sample.
    pub volts: Vec<f64>,
}

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

/// Presses of one session in one mode, as the amplifier's output in volts: the same type for a recording of the real
/// skin and for a simulated one.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    mode: Mode,
    taxels: usize,
    measurements_per_frame: usize,
    frames: usize,
    sample_rate_hz: f64,
    blocks: Vec<Block>,
}

impl Recording {
    /// Recording of `blocks`, all equally long, cut into frames of `measurements_per_frame`.
    ///
    /// # Errors
    /// [`RecordingError`] for an empty shape, a sample rate that is not positive, blocks of different lengths or of a
    /// broken number of frames, a block that begins before the seeds were loaded, or an infinite sample.
    pub fn new(
        mode: Mode,
        taxels: usize,
        measurements_per_frame: usize,
        sample_rate_hz: f64,
        blocks: Vec<Block>,
    ) -> Result<Self, RecordingError> {
        for (field, value) in [
            ("taxels", taxels),
            ("measurements_per_frame", measurements_per_frame),
            ("blocks", blocks.len()),
        ] {
            if value == 0 {
                return Err(RecordingError::Empty { field });
            }
        }
        if !(sample_rate_hz > 0.0 && sample_rate_hz.is_finite()) {
            return Err(RecordingError::SampleRate { value: sample_rate_hz });
        }
        let frames = blocks[0].volts.len() / measurements_per_frame;
        if frames == 0 {
            return Err(RecordingError::Empty { field: "frames" });
        }
        for (block, b) in blocks.iter().enumerate() {
            if b.volts.len() != frames * measurements_per_frame {
                return Err(RecordingError::BlockLength {
                    block,
                    len: b.volts.len(),
                    frames,
                    measurements: measurements_per_frame,
                });
            }
            if b.frame_position < frames as u64 {
                return Err(RecordingError::FramePosition {
                    block,
                    frame_position: b.frame_position,
                    frames,
                });
            }
            if let Some(sample) = b.volts.iter().position(|v| v.is_infinite()) {
                return Err(RecordingError::Infinite {
                    block,
                    sample,
                    value: b.volts[sample],
                });
            }
        }
        Ok(Self {
            mode,
            taxels,
            measurements_per_frame,
            frames,
            sample_rate_hz,
            blocks,
        })
    }

    /// Which readout this is.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Number of taxels, N.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxels
    }

    /// Measurements in a frame (100 in the published recordings).
    #[must_use]
    pub fn measurements_per_frame(&self) -> usize {
        self.measurements_per_frame
    }

    /// Frames in a block (1000 in the published recordings).
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Measurements a second, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// The blocks, in order of recording.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Samples of frame `frame` of block `block`, V.
    ///
    /// # Panics
    /// When the recording has no such block or frame.
    #[must_use]
    pub fn volts(&self, block: usize, frame: usize) -> &[f64] {
        let m = self.measurements_per_frame;
        &self.blocks[block].volts[frame * m..(frame + 1) * m]
    }

    /// Row of the weight matrix that the first measurement of this frame used; the others follow it. It is
    /// `((frame_position − frames) + frame) · measurements_per_frame`, verified against the published recordings.
    ///
    /// # Panics
    /// When the recording has no such block.
    #[must_use]
    pub fn first_row(&self, block: usize, frame: usize) -> u64 {
        (self.blocks[block].frame_position - self.frames as u64 + frame as u64) * self.measurements_per_frame as u64
    }

    /// Time of the first measurement of a frame since the start of its block, s.
    #[must_use]
    pub fn time_s(&self, frame: usize) -> f64 {
        (frame * self.measurements_per_frame) as f64 / self.sample_rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(frame_position: u64, len: usize) -> Block {
        Block {
            frame_position,
            volts: vec![0.0; len],
        }
    }

    #[test]
    fn rows_follow_the_published_alignment() {
        let r = Recording::new(Mode::Compressive, 100, 100, 64_300.0, vec![block(1243, 100_000)]);
        let r = r.unwrap();
        assert_eq!(
            (r.frames(), r.first_row(0, 0), r.first_row(0, 7)),
            (1000, 24_300, 25_000)
        );
        assert_eq!(r.volts(0, 999).len(), 100);
    }

    #[test]
    fn contradictions_are_refused() {
        let new = |rate, blocks| Recording::new(Mode::Raster, 4, 4, rate, blocks);
        assert!(matches!(
            new(1.0, vec![]),
            Err(RecordingError::Empty { field: "blocks" })
        ));
        assert!(matches!(
            new(1.0, vec![block(1, 3)]),
            Err(RecordingError::Empty { field: "frames" })
        ));
        assert!(matches!(
            new(f64::NAN, vec![block(1, 4)]),
            Err(RecordingError::SampleRate { .. })
        ));
        assert!(matches!(
            new(1.0, vec![block(0, 4)]),
            Err(RecordingError::FramePosition { .. })
        ));
        assert!(matches!(
            new(1.0, vec![block(2, 8), block(9, 7)]),
            Err(RecordingError::BlockLength {
                block: 1,
                len: 7,
                frames: 2,
                ..
            })
        ));
        let mut bad = block(1, 4);
        bad.volts[2] = f64::INFINITY;
        assert!(matches!(
            new(1.0, vec![bad]),
            Err(RecordingError::Infinite { sample: 2, .. })
        ));
    }
}
