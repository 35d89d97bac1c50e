//! Plays a recorded session as a device would send it.

use super::virtual_device::{BlockSource, DeviceBlock, DeviceError};
use spts_circuit::{Converter, Mode, Recording};

/// The blocks of a recording, in order.
///
/// ```
/// use spts::device::{BlockSource as _, Played};
/// use spts::{Block, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
///
/// let layout = SkinLayout::new(1, 8, 5e-3, 3e-3)?;
/// let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
/// let block = Block { frame_position: 10, idle_frames: None, volts: vec![0.25; 80] };
/// let recording = Recording::new(info, vec![block])?;
/// assert!(Played::new(&recording).is_err(), "volts without a converter's scale have no codes");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Played<'a> {
    recording: &'a Recording,
    converter: Converter,
    next: usize,
}

impl<'a> Played<'a> {
    /// The blocks of `recording`.
    ///
    /// # Errors
    /// [`DeviceError::Source`] if the recording has no codes, because it was made without a converter or its scale is
    /// unknown.
    pub fn new(recording: &'a Recording) -> Result<Self, DeviceError> {
        let converter = recording.converter().copied().ok_or_else(|| {
            DeviceError::Source(
                "the recording has no codes: its readout has no converter, or one of unknown scale".to_owned(),
            )
        })?;
        Ok(Self {
            recording,
            converter,
            next: 0,
        })
    }
}

impl BlockSource for Played<'_> {
    fn mode(&self) -> Mode {
        self.recording.mode()
    }

    fn sample_rate_hz(&self) -> f64 {
        self.recording.sample_rate_hz()
    }

    fn next_block(&mut self) -> Result<Option<DeviceBlock>, DeviceError> {
        let Some(block) = self.recording.blocks().get(self.next) else {
            return Ok(None);
        };
        self.next += 1;
        // a sample that was lost is sent as 0
        let codes = block.volts.iter().map(|v| self.converter.code(*v).unwrap_or(0));
        Ok(Some(DeviceBlock {
            frame_position: block.frame_position,
            codes: codes.collect(),
        }))
    }
}
