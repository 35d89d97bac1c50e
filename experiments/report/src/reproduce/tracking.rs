//! Tracking a bounce frame by frame (Figs. 5B and 5C).

use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::Scorer;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::place::RecordedBounce;
use spts_input::Refusal;
use spts_recon::statistics::quantile;

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
/// [`Refusal`] when the decoder does not fit the recording.
pub(super) fn traces(
    recording: &Recording,
    bounces: &[RecordedBounce],
    decoder: &TrainedDecoder,
) -> Result<Vec<TraceRow>, Refusal> {
    let of_bounce = |(index, bounce): (usize, &RecordedBounce)| {
        let start = bounce.start.saturating_sub(MARGIN);
        let end = (bounce.end + MARGIN).min(recording.blocks()[bounce.block].volts.len());
        let press = bounce.untouched.press(recording, bounce.block, start..end);
        let mut scorer = Scorer::new(decoder);
        let mut rows = Vec::new();
        for m in TRACKING_MEASUREMENTS {
            let (begins, windows): (Vec<usize>, Vec<_>) = press.windows(0..press.len(), m, m).unzip();
            for (begin, answer) in begins.iter().zip(scorer.answers(&windows)?) {
                let peak_v = WEIGHT_SCALE * answer.image.iter().copied().fold(0.0, f64::max);
                let time_s = ((start + begin + m) as f64 - bounce.start as f64) / recording.sample_rate_hz();
                rows.push(TraceRow { bounce: index, m, time_ms: time_s * 1e3, peak_v });
            }
        }
        Ok(rows)
    };
    let rows = bounces.par_iter().enumerate().map(of_bounce);
    Ok(rows.collect::<Result<Vec<_>, Refusal>>()?.concat())
}

/// Frames in contact and mean change from frame to frame, over all bounces.
pub(super) fn tracking(bounces: &[RecordedBounce], traces: &[TraceRow]) -> Vec<TrackingRow> {
    let samples: usize = bounces.iter().map(|b| b.end - b.start).sum();
    let mean_samples = samples as f64 / bounces.len().max(1) as f64;
    TRACKING_MEASUREMENTS
        .iter()
        .map(|&m| {
            let (mut change, mut count) = (0.0, 0.0);
            for index in 0..bounces.len() {
                let peaks: Vec<f64> =
                    traces.iter().filter(|r| r.bounce == index && r.m == m).map(|r| r.peak_v).collect();
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

/// Largest taxel at one instant, over the bounces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CourseRow {
    /// Measurements a frame.
    pub(super) m: usize,
    /// End of the frame's acquisition since first contact, ms.
    pub(super) time_ms: f64,
    /// Bounces that have a frame there.
    pub(super) bounces: usize,
    /// Lower quartile, V.
    pub(super) low_v: f64,
    /// Median, V.
    pub(super) median_v: f64,
    /// Upper quartile, V.
    pub(super) high_v: f64,
}

/// The course of all bounces in frames of `m` measurements, at the instants at which at least half of the bounces have
/// a frame.
pub(super) fn over_bounces(traces: &[TraceRow], m: usize) -> Vec<CourseRow> {
    // frames begin the same number of measurements before first contact, so that their instants agree
    let instant = |t: &TraceRow| (t.time_ms * 1e3).round();
    let mut of: Vec<&TraceRow> = traces.iter().filter(|t| t.m == m).collect();
    of.sort_by(|a, b| instant(a).total_cmp(&instant(b)).then(a.peak_v.total_cmp(&b.peak_v)));
    let groups: Vec<&[&TraceRow]> = of.chunk_by(|a, b| instant(a).total_cmp(&instant(b)).is_eq()).collect();
    let most = groups.iter().map(|g| g.len()).max().unwrap_or(0);
    let kept = groups.into_iter().filter(|g| 2 * g.len() >= most);
    kept.map(|group| {
        let peaks: Vec<f64> = group.iter().map(|t| t.peak_v).collect();
        let [low_v, median_v, high_v] = [0.25, 0.5, 0.75].map(|share| quantile(&peaks, share).unwrap_or_default());
        CourseRow { m, time_ms: group[0].time_ms, bounces: group.len(), low_v, median_v, high_v }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Four bounces with peaks 1 to 4 V; one frame that a single bounce has is left out.
    #[test]
    fn courses_are_quartiles_over_the_bounces() {
        let trace = |bounce: usize, time_ms: f64, peak_v: f64| TraceRow { bounce, m: 25, time_ms, peak_v };
        let mut traces: Vec<TraceRow> = (0..4).map(|b| trace(b, 0.4, [3.0, 1.0, 4.0, 2.0][b])).collect();
        traces.push(trace(0, 9.0, 7.0));
        let courses = over_bounces(&traces, 25);
        assert_eq!((courses.len(), courses[0].bounces), (1, 4));
        assert_relative_eq!(courses[0].low_v, 1.75);
        assert_relative_eq!(courses[0].median_v, 2.5);
        assert_relative_eq!(courses[0].high_v, 3.25);
        assert!(over_bounces(&traces, 50).is_empty());
    }
}
