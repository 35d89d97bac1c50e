//! Which frames are scored, and against what: the published evaluation's rules. The twin's sheet is worked in before its session begins,
//! so its presses are scored from the first on.

use spts_circuit::Recording;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};

/// Numbers of measurements of the published curves.
pub const MEASUREMENTS: [usize; 14] = [2, 3, 5, 7, 10, 13, 15, 20, 25, 30, 40, 50, 75, 100];

/// Frames and presses that are scored (0-based).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Protocol {
    /// First press scored; the presses before it condition the foam, and are learned from.
    pub first_press: usize,
    /// Number of presses scored.
    pub presses: usize,
    /// First frame scored.
    pub first_frame: usize,
    /// Number of frames scored.
    pub frames: usize,
    /// Every how manieth frame starts a window for the support scores.
    pub support_stride: usize,
    /// Most windows a press for the classification scores; they follow each other without a gap.
    pub max_windows: usize,
    /// Decisions in a vote.
    pub vote: usize,
    /// Press and frame of the raster session that is the truth.
    pub truth: (usize, usize),
}

impl Default for Protocol {
    fn default() -> Self {
        Self {
            first_press: 5,
            presses: 10,
            first_frame: 500,
            frames: 200,
            support_stride: 10,
            max_windows: 300,
            vote: 20,
            truth: (9, 599),
        }
    }
}

impl Protocol {
    /// Presses of `recording` that are scored.
    #[must_use]
    pub fn presses_of(&self, recording: &Recording) -> std::ops::Range<usize> {
        let end = (self.first_press + self.presses).min(recording.blocks().len());
        self.first_press.min(end)..end
    }

    /// Number of classification windows of `m` measurements a press: whole votes only.
    #[must_use]
    pub fn windows(&self, m: usize, measurements_per_frame: usize) -> usize {
        let fitting = self.frames * measurements_per_frame / m.max(1);
        fitting.min(self.max_windows) / self.vote * self.vote
    }
}

/// True contact of an object: a raster image and its support.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Raster image, V.
    pub image: Vec<f64>,
    /// Taxels above the threshold.
    pub support: Vec<bool>,
}

impl Truth {
    /// Truth from the raster session of the object; the last press when there are fewer.
    #[must_use]
    pub fn new(raster: &Recording, protocol: &Protocol) -> Self {
        let press = protocol.truth.0.min(raster.blocks().len() - 1);
        let frame = protocol.truth.1.min(raster.frames() - 1);
        let image = raster.volts(press, frame).to_vec();
        let mut mask = Vec::new();
        support(&image, SUPPORT_THRESHOLD, &mut mask);
        Self { image, support: mask }
    }
}
