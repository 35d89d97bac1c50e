//! Tracking a bounce frame by frame (Figs. 5B and 5C).

use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::place::RecordedBounce;
use spts_eval::{Press, ScoreError, Scorer};

/// Numbers of measurements a frame that are compared.
pub(super) const TRACKING_MEASUREMENTS: [usize; 4] = [25, 50, 75, 100];
/// The figures' volts are those of weights Φ − ½, half as large as the decoder's ±1.
const WEIGHT_SCALE: f64 = 2.0;
/// Measurements before and after the contact that are shown.
const MARGIN: usize = 150;

/// Largest value of one reconstructed frame of one bounce.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TraceRow {
    /// Number of the bounce in the recording.
    pub(super) bounce: usize,
    /// Measurements a frame.
    pub(super) m: usize,
    /// End of the frame's acquisition since first contact, ms.
    pub(super) time_ms: f64,
    /// Largest value of the image, V.
    pub(super) peak_v: f64,
}

/// Frames of a bounce at one M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TrackingRow {
    /// Measurements a frame.
    pub(super) m: usize,
    /// Mean number of frames within a contact.
    pub(super) frames_in_contact: f64,
    /// Mean absolute change of the image's largest value from frame to frame, V.
    pub(super) mean_change_v: f64,
}

/// Peak value over time for every bounce and M, as `decoder` decodes it.
///
/// # Errors
/// [`ScoreError`] when the decoder does not fit the recording.
pub(super) fn traces(
    recording: &Recording,
    bounces: &[RecordedBounce],
    decoder: &TrainedDecoder,
) -> Result<Vec<TraceRow>, ScoreError> {
    let of_bounce = |(index, bounce): (usize, &RecordedBounce)| {
        let start = bounce.start.saturating_sub(MARGIN);
        let end = (bounce.end + MARGIN).min(recording.blocks()[bounce.block].volts.len());
        let press = Press::within(recording, bounce.block, start..end, bounce.idle);
        let mut scorer = Scorer::new(decoder);
        let mut rows = Vec::new();
        for m in TRACKING_MEASUREMENTS {
            let (begins, windows): (Vec<usize>, Vec<_>) = press.windows(0..press.len(), m, m).unzip();
            for (begin, answer) in begins.iter().zip(scorer.answers(&windows)?) {
                let peak_v = WEIGHT_SCALE * answer.image.iter().copied().fold(0.0, f64::max);
                let time_s = ((start + begin + m) as f64 - bounce.start as f64) / recording.sample_rate_hz();
                rows.push(TraceRow {
                    bounce: index,
                    m,
                    time_ms: time_s * 1e3,
                    peak_v,
                });
            }
        }
        Ok(rows)
    };
    let rows = bounces.par_iter().enumerate().map(of_bounce);
    Ok(rows.collect::<Result<Vec<_>, ScoreError>>()?.concat())
}

/// Frames in contact and mean change from frame to frame, over all bounces.
#[must_use]
pub(super) fn tracking(bounces: &[RecordedBounce], traces: &[TraceRow]) -> Vec<TrackingRow> {
    let samples: usize = bounces.iter().map(|b| b.end - b.start).sum();
    let mean_samples = samples as f64 / bounces.len().max(1) as f64;
    TRACKING_MEASUREMENTS
        .iter()
        .map(|&m| {
            let (mut change, mut count) = (0.0, 0.0);
            for index in 0..bounces.len() {
                let peaks: Vec<f64> = traces
                    .iter()
                    .filter(|r| r.bounce == index && r.m == m)
                    .map(|r| r.peak_v)
                    .collect();
                for pair in peaks.windows(2) {
                    change += (pair[1] - pair[0]).abs();
                    count += 1.0;
                }
            }
            TrackingRow {
                m,
                frames_in_contact: mean_samples / m as f64,
                mean_change_v: if count > 0.0 { change / count } else { 0.0 },
            }
        })
        .collect()
}
