//! What an algorithm is given: consecutive measurements with their rows of weights.

use crate::score::{Protocol, idle_mean};
use spts_circuit::Recording;
use spts_recon::MatrixView;

/// The scored measurements of one press, with their rows of weights.
#[derive(Debug, Clone)]
pub struct Press {
    taxels: usize,
    phi: Vec<f64>,
    signs: Option<Vec<u64>>,
    volts: Vec<f64>,
    y: Vec<f64>,
}

/// M consecutive measurements.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// Rows of weights, M × taxels.
    pub phi: MatrixView<'a>,
    /// The same as bits, where all weights are ±1: [`WeightRows::sign_bits`](spts_circuit::WeightRows::sign_bits).
    pub signs: Option<&'a [u64]>,
    /// Output of the summing amplifier, V.
    pub volts: &'a [f64],
    /// The same without the mean output of the untouched skin, V.
    pub y: &'a [f64],
}

impl Press {
    /// Scored frames of block `block` of `recording`.
    #[must_use]
    pub fn new(recording: &Recording, block: usize, protocol: &Protocol) -> Self {
        let per_frame = recording.measurements_per_frame();
        let first = protocol.first_frame.min(recording.frames());
        let frames = protocol.frames.min(recording.frames() - first);
        Self::of(recording, block, first * per_frame, frames * per_frame)
    }

    /// Measurements `start..start + len` of block `block` of `recording`, as far as there are any.
    #[must_use]
    pub fn of(recording: &Recording, block: usize, start: usize, len: usize) -> Self {
        let all = recording.blocks()[block].volts.len();
        let (start, taxels) = (start.min(all), recording.taxels());
        let len = len.min(all - start);
        let rows = recording.rows(block, start..start + len);
        let (phi, signs) = (rows.to_vec(), rows.sign_bits());
        let volts = recording.blocks()[block].volts[start..start + len].to_vec();
        let idle = idle_mean(recording, block);
        let y = volts.iter().map(|v| v - idle).collect();
        Self {
            taxels,
            phi,
            signs,
            volts,
            y,
        }
    }

    /// Number of measurements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// True without a measurement.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Measurements `start..start + m`; `None` when they reach beyond the press or one of them was lost.
    #[must_use]
    pub fn window(&self, start: usize, m: usize) -> Option<Window<'_>> {
        let y = self.y.get(start..start + m)?;
        let words = self.taxels.div_ceil(64);
        let phi = &self.phi[start * self.taxels..(start + m) * self.taxels];
        y.iter().all(|v| v.is_finite()).then_some(())?;
        Some(Window {
            phi: MatrixView::new(m, self.taxels, phi).ok()?,
            signs: self.signs.as_ref().map(|s| &s[start * words..(start + m) * words]),
            volts: &self.volts[start..start + m],
            y,
        })
    }
}
