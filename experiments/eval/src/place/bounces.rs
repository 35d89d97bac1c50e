//! The bouncing ball in a compressive recording: times and true images of its contacts.

use crate::protocol::PUBLISHED_RATE_HZ;
use nalgebra::{DMatrix, DVector};
use spts_circuit::Recording;
use spts_recon::metrics::median;

/// One contact of the ball: measurements `start..end` of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedBounce {
    /// Block of the recording.
    pub block: usize,
    /// First measurement in contact.
    pub start: usize,
    /// One past the last measurement in contact.
    pub end: usize,
    /// Output with nothing on the skin, V.
    pub idle: f64,
}

impl RecordedBounce {
    /// Duration of the contact, s.
    #[must_use]
    pub fn duration_s(&self, recording: &Recording) -> f64 {
        (self.end - self.start) as f64 / recording.sample_rate_hz()
    }
}

/// Width of the moving root mean square that detects contact, measurements of the published skin.
const ENVELOPE: usize = 16;
/// Contact when the envelope is above this many times its median; the quiet wire stays below 2.4 times.
const THRESHOLD: f64 = 2.6;
/// Gaps shorter than this belong to the same contact, measurements of the published skin.
const GAP: usize = 100;
/// Shorter events are not contacts of a ball, measurements of the published skin (3 ms).
const SHORTEST: usize = 200;

/// Contacts of the ball in every block, detected by the moving root mean square of the output about its median.
#[must_use]
pub fn find_bounces(recording: &Recording) -> Vec<RecordedBounce> {
    recording
        .blocks()
        .iter()
        .enumerate()
        .flat_map(|(block, b)| contacts(block, &b.volts, recording.sample_rate_hz()))
        .collect()
}

fn contacts(block: usize, volts: &[f64], rate_hz: f64) -> Vec<RecordedBounce> {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let own = |measurements: usize| (measurements as f64 * rate_hz / PUBLISHED_RATE_HZ).round().max(1.0) as usize;
    let (width, gap, shortest) = (own(ENVELOPE).max(2), own(GAP), own(SHORTEST));
    let finite: Vec<f64> = volts.iter().copied().filter(|v| v.is_finite()).collect();
    let Some(idle) = median(&finite) else {
        return Vec::new();
    };
    let square: Vec<f64> = volts
        .iter()
        .map(|v| if v.is_finite() { (v - idle).powi(2) } else { 0.0 })
        .collect();
    let half = width / 2;
    let mut envelope = vec![0.0; square.len()];
    let mut sum = 0.0;
    for i in 0..square.len() + half {
        sum += square.get(i).unwrap_or(&0.0);
        if i >= width {
            sum -= square[i - width];
        }
        if i >= half {
            envelope[i - half] = sum.max(0.0).sqrt();
        }
    }
    let Some(quiet) = median(&envelope) else {
        return Vec::new();
    };
    let mut found: Vec<RecordedBounce> = Vec::new();
    for (i, _) in envelope.iter().enumerate().filter(|(_, e)| **e > THRESHOLD * quiet) {
        match found.last_mut() {
            Some(last) if i - last.end < gap => last.end = i + 1,
            _ => found.push(RecordedBounce {
                block,
                start: i,
                end: i + 1,
                idle,
            }),
        }
    }
    found.retain(|b| b.end - b.start >= shortest);
    found
}

/// Least-squares image of a whole contact: min ‖Φ x − (y − idle)‖₂ with the recording's Φ, negative values set to zero.
/// `None` if a sample is lost, or the normal equations are singular.
#[must_use]
pub fn contact_image(recording: &Recording, bounce: &RecordedBounce) -> Option<Vec<f64>> {
    let (n, m) = (recording.taxels(), bounce.end - bounce.start);
    let rows = recording.rows(bounce.block, bounce.start..bounce.end).to_vec();
    let phi = DMatrix::from_row_slice(m, n, &rows);
    let y = DVector::from_iterator(
        m,
        recording.blocks()[bounce.block].volts[bounce.start..bounce.end]
            .iter()
            .map(|v| v - bounce.idle),
    );
    if y.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let image = phi.tr_mul(&phi).cholesky()?.solve(&phi.tr_mul(&y));
    Some(image.iter().map(|v| v.max(0.0)).collect())
}
