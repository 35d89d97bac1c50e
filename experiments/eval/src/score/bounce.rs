//! The bouncing ball in a compressive recording: when it touches, where, and how well few measurements say so.

use super::decode::{Decode, Decoder, Projected};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::Recording;
use spts_recon::Matrix;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, median};
use spts_recon::recover::ReferenceOmp;

/// One contact of the ball: measurements `start..end` of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// Block of the recording.
    pub block: usize,
    /// First measurement in contact.
    pub start: usize,
    /// One past the last measurement in contact.
    pub end: usize,
    /// Output with nothing on the skin, V.
    pub idle: f64,
}

impl Bounce {
    /// Duration of the contact, s.
    #[must_use]
    pub fn duration_s(&self, recording: &Recording) -> f64 {
        (self.end - self.start) as f64 / recording.sample_rate_hz()
    }
}

/// Width of the moving root mean square that detects contact, measurements.
const ENVELOPE: usize = 16;
/// Contact when the envelope is above this many times its median; the quiet wire stays below 2.4 times.
const THRESHOLD: f64 = 2.6;
/// Gaps shorter than this belong to the same contact, measurements.
const GAP: usize = 100;
/// Shorter events are not contacts of a ball, measurements (3 ms).
const SHORTEST: usize = 200;

/// Contacts of the ball in every block, by the moving root mean square of the output about its median.
#[must_use]
pub fn find_bounces(recording: &Recording) -> Vec<Bounce> {
    recording
        .blocks()
        .iter()
        .enumerate()
        .flat_map(|(block, b)| contacts(block, &b.volts))
        .collect()
}

fn contacts(block: usize, volts: &[f64]) -> Vec<Bounce> {
    let finite: Vec<f64> = volts.iter().copied().filter(|v| v.is_finite()).collect();
    let Some(idle) = median(&finite) else {
        return Vec::new();
    };
    let square: Vec<f64> = volts
        .iter()
        .map(|v| if v.is_finite() { (v - idle).powi(2) } else { 0.0 })
        .collect();
    let half = ENVELOPE / 2;
    let mut envelope = vec![0.0; square.len()];
    let mut sum = 0.0;
    for i in 0..square.len() + half {
        sum += square.get(i).unwrap_or(&0.0);
        if i >= ENVELOPE {
            sum -= square[i - ENVELOPE];
        }
        if i >= half {
            envelope[i - half] = sum.max(0.0).sqrt();
        }
    }
    let Some(quiet) = median(&envelope) else {
        return Vec::new();
    };
    let mut found: Vec<Bounce> = Vec::new();
    for (i, _) in envelope.iter().enumerate().filter(|(_, e)| **e > THRESHOLD * quiet) {
        match found.last_mut() {
            Some(last) if i - last.end < GAP => last.end = i + 1,
            _ => found.push(Bounce {
                block,
                start: i,
                end: i + 1,
                idle,
            }),
        }
    }
    found.retain(|b| b.end - b.start >= SHORTEST);
    found
}

/// Least-squares image of a whole contact: min ‖Φ x − (y − idle)‖₂ with the recording's Φ, negative values set to zero. `None` when
/// a sample is lost or the normal equations are singular.
#[must_use]
pub fn contact_image(recording: &Recording, bounce: &Bounce) -> Option<Vec<f64>> {
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

/// Decodes of the localisation board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BounceDecode {
    /// As the published script: weights {0, 1}, no offset, 5 atoms. Centre of mass over the positive values: with the
    /// negative ones, as they leave the decode, the sum comes near zero and the centre far off the sheet.
    ScriptS5,
    /// Φ − ½, the idle mean removed, M/4 atoms, centre of mass above .23 of the maximum.
    Matched,
}

impl BounceDecode {
    /// Every decode.
    pub const ALL: [Self; 2] = [Self::ScriptS5, Self::Matched];

    fn name(self) -> &'static str {
        match self {
            Self::ScriptS5 => "script_s5",
            Self::Matched => "matched",
        }
    }
}

/// One line of the localisation board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LocalisationRow {
    /// Decode.
    pub decode: &'static str,
    /// Number of measurements.
    pub m: usize,
    /// Mean distance between the estimated and the true centre, taxels.
    pub mean_px: f64,
    /// Median distance, taxels.
    pub median_px: f64,
    /// Share of windows within one taxel.
    pub share_under_1px: f64,
}

/// Localises every contact from every window of M consecutive measurements. The truth is the centre of mass of the
/// contact's least-squares image; an empty decode counts as the middle of the sheet.
#[must_use]
pub fn localise(
    recording: &Recording,
    bounces: &[Bounce],
    shifted: &Matrix,
    measurements: &[usize],
    cols: usize,
) -> Vec<LocalisationRow> {
    let jobs: Vec<(BounceDecode, usize)> = BounceDecode::ALL
        .iter()
        .flat_map(|&d| measurements.iter().map(move |&m| (d, m)))
        .collect();
    let per_bounce: Vec<Vec<Vec<f64>>> = bounces
        .par_iter()
        .filter_map(|bounce| {
            let truth = centre_of_mass(&contact_image(recording, bounce)?, cols, SUPPORT_THRESHOLD)?;
            let length = bounce.end - bounce.start;
            let projected = Projected::new(recording, bounce.block, bounce.start, length, bounce.idle, shifted);
            let errors = jobs
                .iter()
                .map(|&(d, m)| distances(&projected, shifted, d, m, cols, truth));
            Some(errors.collect())
        })
        .collect();
    let rows = jobs.iter().enumerate().filter_map(|(i, (decode, m))| {
        let errors: Vec<f64> = per_bounce.iter().flat_map(|b| b[i].iter().copied()).collect();
        let count = errors.len() as f64;
        let near = errors.iter().filter(|e| **e < 1.0).count() as f64;
        Some(LocalisationRow {
            decode: decode.name(),
            m: *m,
            mean_px: errors.iter().sum::<f64>() / count,
            median_px: median(&errors)?,
            share_under_1px: near / count,
        })
    });
    rows.collect()
}

fn distances(
    projected: &Projected,
    shifted: &Matrix,
    decode: BounceDecode,
    m: usize,
    cols: usize,
    truth: [f64; 2],
) -> Vec<f64> {
    let mut decoder = Decoder::new(shifted);
    let middle = [((shifted.nrows() / cols - 1) as f64) / 2.0, ((cols - 1) as f64) / 2.0];
    let (weights, pursuit, threshold) = match decode {
        BounceDecode::ScriptS5 => (Decode::ScriptS20, ReferenceOmp::new(5), 0.0),
        BounceDecode::Matched => (Decode::Matched, Decode::Matched.pursuit(m), SUPPORT_THRESHOLD),
    };
    (0..(projected.len() + 1).saturating_sub(m))
        .step_by(m.max(1))
        .filter_map(|start| {
            let image = decoder.decode_by(projected, weights, &pursuit, start, m)?;
            let centre = centre_of_mass(image, cols, threshold);
            Some(distance(centre.unwrap_or(middle), truth))
        })
        .collect()
}
