//! Recordings: the interface between a skin, real or simulated, and everything that decodes it.

use crate::converter::Converter;
use crate::mode::Mode;
use crate::recording_error::RecordingError;
use crate::recording_info::RecordingInfo;
use crate::weight_rows::WeightRows;
use crate::weights::Weights;
use spts_models::SkinLayout;
use std::ops::Range;

/// One press: consecutive frames without a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Frames from loading the seeds to the END of the block.
    pub frame_position: u64,
    /// Frames at the start of the block in which nothing touches the skin; `None` if that is not known.
    pub idle_frames: Option<usize>,
    /// Output of the summing amplifier, sign-flipped, V; measurement `m` of frame `f` is entry
    /// `f · measurements_per_frame + m`. NaN where the instrument lost a sample.
    pub volts: Vec<f64>,
}

/// Presses of one session in one mode, as the amplifier's output in volts. Recordings of the real skin and simulated
/// ones have this same type.
///
/// ```
/// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
/// use spts_models::SkinLayout;
///
/// let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
/// let info = RecordingInfo::new(SkinLayout::default(), weights, 64_300.0);
/// let block = Block {
///     frame_position: 1243,
///     idle_frames: Some(150),
///     volts: vec![0.0; 1000 * 100],
/// };
/// let recording = Recording::new(info, vec![block])?;
/// // weights and samples of twenty measurements of the hold: what a decoder is given
/// let measurements = 50_000..50_020;
/// let phi = recording.rows(0, measurements.clone()).to_vec();
/// let y = &recording.blocks()[0].volts[measurements];
/// assert_eq!((phi.len(), y.len()), (20 * 100, 20));
/// # Ok::<(), spts_circuit::RecordingError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    info: RecordingInfo,
    frames: usize,
    blocks: Vec<Block>,
}

impl Recording {
    /// A recording of `blocks`, all equally long, with the metadata `info`.
    ///
    /// # Errors
    /// [`RecordingError`] for no block, measurement or frame; a sample rate that is not positive; weights of another
    /// skin; blocks of different lengths or an incomplete frame; an infinite sample; or a block that begins before the
    /// seeds are loaded, ends beyond the largest row number, or is idle for longer than it lasts.
    pub fn new(info: RecordingInfo, blocks: Vec<Block>) -> Result<Self, RecordingError> {
        info.check()?;
        let measurements = info.measurements_per_frame;
        let Some(first) = blocks.first() else {
            return Err(RecordingError::Empty { field: "blocks" });
        };
        let frames = first.volts.len() / measurements;
        if frames == 0 {
            return Err(RecordingError::Empty { field: "frames" });
        }
        for (block, b) in blocks.iter().enumerate() {
            if b.volts.len() != frames * measurements {
                return Err(RecordingError::BlockLength {
                    block,
                    len: b.volts.len(),
                    frames,
                    measurements,
                });
            }
            if b.frame_position < frames as u64 {
                return Err(RecordingError::FramePosition {
                    block,
                    frame_position: b.frame_position,
                    frames,
                });
            }
            if b.frame_position.checked_mul(measurements as u64).is_none() {
                return Err(RecordingError::RowCount {
                    block,
                    frame_position: b.frame_position,
                    frames,
                    limit: u64::MAX / measurements as u64,
                });
            }
            if let Some(idle_frames) = b.idle_frames.filter(|idle| *idle > frames) {
                return Err(RecordingError::IdleFrames {
                    block,
                    idle_frames,
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
        Ok(Self { info, frames, blocks })
    }

    /// The same recording with other blocks. The converter's scale is kept only if it could have produced every sample.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub fn with_blocks(&self, blocks: Vec<Block>) -> Result<Self, RecordingError> {
        let mut info = self.info.clone();
        let made = |converter: &Converter| blocks.iter().all(|block| converter.made(&block.volts));
        info.converter = info.converter.filter(made);
        Self::new(info, blocks)
    }

    /// The same recording with blocks whose samples are this recording's own at other places, or lost.
    pub(crate) fn with_samples_of(&self, blocks: Vec<Block>) -> Self {
        Self {
            info: self.info.clone(),
            frames: self.frames,
            blocks,
        }
    }

    /// The same recording, in which the first `idle_frames` frames of every block are marked as idle (at most the whole
    /// block); `None` if it is not known.
    #[must_use]
    pub fn with_idle_frames(mut self, idle_frames: Option<usize>) -> Self {
        let idle_frames = idle_frames.map(|idle| idle.min(self.frames));
        for block in &mut self.blocks {
            block.idle_frames = idle_frames;
        }
        self
    }

    /// Metadata of the recording.
    #[must_use]
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Layout of the recorded skin.
    #[must_use]
    pub fn layout(&self) -> &SkinLayout {
        &self.info.layout
    }

    /// Weights that the cells were meant to put out. Decoders use [`Recording::rows`] instead.
    #[must_use]
    pub fn weights(&self) -> &Weights {
        &self.info.weights
    }

    /// Scale of the converter; `None` if no converter acted or its scale is not known.
    #[must_use]
    pub fn converter(&self) -> Option<&Converter> {
        self.info.converter.as_ref()
    }

    /// Rows of the weight matrix Φ of the measurements `measurements` of block `block`, both from 0; measurements are
    /// counted within the block.
    ///
    /// # Panics
    /// If the recording has no such block, or the block no such measurements.
    #[must_use]
    pub fn rows(&self, block: usize, measurements: Range<usize>) -> WeightRows<'_> {
        let len = self.blocks[block].volts.len();
        assert!(
            measurements.start <= measurements.end && measurements.end <= len,
            "measurements {measurements:?} of {len}"
        );
        let first_row = self.first_row(block, 0) + measurements.start as u64;
        WeightRows::new(&self.info.weights, first_row, measurements.len())
    }

    /// The readout that made the recording.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.info.mode()
    }

    /// Number of taxels, N.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.info.layout.taxels()
    }

    /// Measurements in a frame (100 in the published recordings).
    #[must_use]
    pub fn measurements_per_frame(&self) -> usize {
        self.info.measurements_per_frame
    }

    /// Frames in a block (1000 in the published recordings).
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Measurements a second, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.info.sample_rate_hz
    }

    /// The blocks, in order of recording.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Samples of frame `frame` of block `block`, V.
    ///
    /// # Panics
    /// If the recording has no such block or frame.
    #[must_use]
    pub fn volts(&self, block: usize, frame: usize) -> &[f64] {
        let m = self.info.measurements_per_frame;
        &self.blocks[block].volts[frame * m..(frame + 1) * m]
    }

    /// Row of the weight matrix at the first measurement of this frame; the following measurements use the following
    /// rows. It is `((frame_position − frames) + frame) · measurements_per_frame`, verified against the published
    /// recordings.
    ///
    /// # Panics
    /// If the recording has no such block.
    #[must_use]
    pub fn first_row(&self, block: usize, frame: usize) -> u64 {
        (self.blocks[block].frame_position - self.frames as u64 + frame as u64)
            * self.info.measurements_per_frame as u64
    }

    /// Time of the first measurement of a frame since the start of its block, s.
    #[must_use]
    pub fn time_s(&self, frame: usize) -> f64 {
        (frame * self.info.measurements_per_frame) as f64 / self.info.sample_rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mode::WeightMode;
    use crate::seeding::Seeding;

    fn info(side: usize, mode: WeightMode, sample_rate_hz: f64) -> RecordingInfo {
        let layout = SkinLayout::new(side, side, 15e-3, 10e-3).unwrap();
        let taxels = u32::try_from(side * side).unwrap();
        RecordingInfo::new(layout, Weights::new(mode, Seeding::Address, taxels), sample_rate_hz)
    }

    fn block(frame_position: u64, len: usize) -> Block {
        Block {
            frame_position,
            idle_frames: None,
            volts: vec![0.0; len],
        }
    }

    #[test]
    fn rows_follow_the_published_alignment() {
        let info = info(10, WeightMode::Binary, 64_300.0);
        let r = Recording::new(info, vec![block(1243, 100_000)]).unwrap();
        assert_eq!(
            (r.frames(), r.first_row(0, 0), r.first_row(0, 7)),
            (1000, 24_300, 25_000)
        );
        assert_eq!(r.volts(0, 999).len(), 100);
        let rows = r.rows(0, 700..720);
        assert_eq!((rows.first_row(), rows.len(), rows.taxels()), (25_000, 20, 100));
    }

    #[test]
    fn contradictions_are_refused() {
        let new = |rate, blocks| Recording::new(info(2, WeightMode::Raster, rate), blocks);
        let other = RecordingInfo {
            layout: SkinLayout::default(),
            ..info(2, WeightMode::Binary, 1.0)
        };
        assert_eq!(
            Recording::new(other, vec![block(1, 100)]),
            Err(RecordingError::Taxels {
                weights: 4,
                layout: 100
            })
        );
        let idle = Block {
            idle_frames: Some(3),
            ..block(2, 8)
        };
        assert!(matches!(
            new(1.0, vec![idle]),
            Err(RecordingError::IdleFrames { idle_frames: 3, .. })
        ));
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
        let limit = u64::MAX / 4;
        assert!(new(1.0, vec![block(limit, 8)]).is_ok());
        let said = new(1.0, vec![block(limit + 1, 8)]).unwrap_err().to_string();
        let expected = format!("block 0 has `frame_position` = {}, outside [2, {limit}]", limit + 1);
        assert_eq!(said, expected);
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
