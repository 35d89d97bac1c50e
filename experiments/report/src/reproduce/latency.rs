//! How soon after contact an object is recognised (Fig. 3E).

use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::{Press, ScoredSession, ScoredSkin, Scorer, idle_mean};
use spts_input::Refusal;
use spts_recon::Workspace;
use spts_recon::classify::majority;
use spts_recon::metrics::median;

/// Frames between first contact and the start of the published classification in time.
const PUBLISHED_DELAY: usize = 100;
/// Length of the published classification in time, s.
const PUBLISHED_SPAN_S: f64 = 4e-3;
/// Numbers of measurements of the curves.
pub(super) const LATENCY_MEASUREMENTS: [usize; 4] = [25, 50, 75, 100];
/// Instants after first contact at which a single window is classified, s.
const AFTER_CONTACT_S: [f64; 12] = [0.002, 0.005, 0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.25, 0.3];

/// One point of a curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LatencyRow {
    /// "published": vote of all windows from 100 frames after first contact on. "contact": a single window that many ms
    /// after first contact.
    pub(super) rule: &'static str,
    /// "matched" or "raster".
    pub(super) decode: &'static str,
    /// Number of measurements a window.
    pub(super) m: usize,
    /// Time since the start of the rule, ms; acquisition included.
    pub(super) time_ms: f64,
    /// Share of presses classified correctly.
    pub(super) accuracy: f64,
}

/// Curves of a skin, over all presses and objects that have a compressive session, as `decoder` decodes them.
///
/// # Errors
/// [`Refusal`] when the decoder does not fit the recordings.
pub(super) fn latency(skin: &ScoredSkin, decoder: &TrainedDecoder) -> Result<Vec<LatencyRow>, Refusal> {
    let presses: Vec<(&ScoredSession, &Recording, usize)> = skin
        .sessions
        .iter()
        .filter_map(|s| s.compressive.as_ref().map(|r| (s, r)))
        .flat_map(|(s, r)| s.scored().map(move |block| (s, r, block)))
        .collect();
    let Some(&(_, first, _)) = presses.first() else {
        return Ok(Vec::new());
    };
    let keys = keys(first.sample_rate_hz());
    let hits: Vec<Vec<bool>> = presses
        .par_iter()
        .filter_map(|&(session, recording, block)| {
            let onset = onset_frame(recording, block)?;
            Some(press_hits(decoder, session.label, recording, block, onset, &keys))
        })
        .collect::<Result<_, Refusal>>()?;
    let share = |i: usize| hits.iter().filter(|h| h[i]).count() as f64 / hits.len().max(1) as f64;
    let mut rows: Vec<LatencyRow> =
        keys.iter().enumerate().map(|(i, key)| LatencyRow { accuracy: share(i), ..key.clone() }).collect();
    rows.extend(raster(skin));
    Ok(rows)
}

/// All points of the compressive curves.
fn keys(rate_hz: f64) -> Vec<LatencyRow> {
    let mut keys = Vec::new();
    for m in LATENCY_MEASUREMENTS {
        let window_s = m as f64 / rate_hz;
        let row =
            |rule, time_s: f64| LatencyRow { rule, decode: "matched", m, time_ms: time_s * 1e3, accuracy: f64::NAN };
        let mut end_s = window_s;
        while end_s <= PUBLISHED_SPAN_S {
            keys.push(row("published", end_s));
            end_s += window_s;
        }
        keys.extend(AFTER_CONTACT_S.iter().map(|t| row("contact", t + window_s)));
    }
    keys
}

#[expect(clippy::cast_possible_truncation, reason = "sample indices of one press, far below 2^52 and never negative")]
fn press_hits(
    decoder: &TrainedDecoder,
    label: usize,
    recording: &Recording,
    block: usize,
    onset: usize,
    keys: &[LatencyRow],
) -> Result<Vec<bool>, Refusal> {
    let per_frame = recording.measurements_per_frame();
    let idle_v = idle_mean(recording, block);
    let mut scorer = Scorer::new(decoder);
    let mut classify = |start: usize, m: usize| {
        if start + m > recording.frames() * per_frame {
            return Ok(None);
        }
        let press = Press::within(recording, block, start..start + m, idle_v);
        let window: Vec<_> = press.window(0, m).into_iter().collect();
        let answers = scorer.answers(&window)?;
        Ok::<_, Refusal>(answers.first().and_then(|answer| scorer.class(answer)))
    };
    let mut votes: Vec<Option<usize>> = Vec::new();
    let mut last_m = 0;
    keys.iter()
        .map(|key| {
            if key.m != last_m {
                votes.clear();
                last_m = key.m;
            }
            if key.rule == "published" {
                let start = (onset + PUBLISHED_DELAY) * per_frame + votes.len() * key.m;
                votes.push(classify(start, key.m)?);
                Ok(majority(&votes) == Some(label))
            } else {
                let delay = (key.time_ms * 1e-3 * recording.sample_rate_hz()).round() as usize - key.m;
                Ok(classify(onset * per_frame + delay, key.m)? == Some(label))
            }
        })
        .collect()
}

/// The control: whole raster frames, the first one complete after N measurements.
fn raster(skin: &ScoredSkin) -> Vec<LatencyRow> {
    let Some(first) = skin.sessions.first().and_then(|s| s.raster.as_ref()) else {
        return Vec::new();
    };
    let frame_s = first.measurements_per_frame() as f64 / first.sample_rate_hz();
    let right = |session: &ScoredSession, recording: &Recording, block: usize, frames: usize| {
        let start = onset_frame(recording, block)? + PUBLISHED_DELAY;
        let mut work = Workspace::default();
        let classify = |frame| skin.learned.classifier.classify(recording.volts(block, frame), &mut work);
        let frames = (start..start + frames).filter(|frame| *frame < recording.frames());
        let votes: Vec<Option<usize>> = frames.map(classify).map(Result::unwrap_or_default).collect();
        Some(majority(&votes) == Some(session.label))
    };
    let ends = (1..=8).map(|k| (k, k as f64 * frame_s)).take_while(|(_, t)| *t <= PUBLISHED_SPAN_S);
    let row = |(frames, end_s): (usize, f64)| {
        let with = skin.sessions.par_iter().filter_map(|session| Some((session, session.raster.as_ref()?)));
        let hits = with.flat_map_iter(|(session, recording)| {
            let presses = session.raster_protocol.presses_of(recording);
            presses.filter_map(move |block| right(session, recording, block, frames))
        });
        let hits: Vec<bool> = hits.collect();
        LatencyRow {
            rule: "published",
            decode: "raster",
            m: first.taxels(),
            time_ms: end_s * 1e3,
            accuracy: hits.iter().filter(|h| **h).count() as f64 / hits.len().max(1) as f64,
        }
    };
    ends.map(row).collect()
}

/// A frame is in contact when its distance from the idle frame is above this many times the idle frames' median.
const THRESHOLD: f64 = 2.0;
/// So many frames in a row must be.
const RUN: usize = 3;

/// First frame of `block` in contact; `None` when nothing touches, or when it is not known which frames are idle.
pub(super) fn onset_frame(recording: &Recording, block: usize) -> Option<usize> {
    let idle_frames = recording.blocks()[block].idle_frames?.max(1);
    let mut idle = vec![0.0; recording.measurements_per_frame()];
    for frame in 0..idle_frames {
        for (sum, v) in idle.iter_mut().zip(recording.volts(block, frame)) {
            *sum += if v.is_finite() { *v } else { 0.0 };
        }
    }
    idle.iter_mut().for_each(|sum| *sum /= idle_frames as f64);
    let distance = |frame: usize| {
        let squares = recording
            .volts(block, frame)
            .iter()
            .zip(&idle)
            .map(|(v, i)| if v.is_finite() { (v - i).powi(2) } else { 0.0 });
        squares.sum::<f64>().sqrt()
    };
    let quiet = median(&(0..idle_frames).map(distance).collect::<Vec<_>>())?;
    let mut run = 0;
    for frame in idle_frames..recording.frames() {
        run = if distance(frame) > THRESHOLD * quiet { run + 1 } else { 0 };
        if run == RUN {
            return Some(frame + 1 - RUN);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    #[test]
    fn finds_the_first_of_three_loud_frames() {
        // four measurements a frame; ±0.1 V idle, a glitch in frame 12, contact from frame 20
        let volts: Vec<f64> = (0..40 * 4)
            .map(|i| {
                let idle = if i % 3 == 0 { 0.1 } else { -0.1 };
                idle + if i / 4 == 12 || i / 4 >= 20 { 1.0 } else { 0.0 }
            })
            .collect();
        let block = Block { frame_position: 40, idle_frames: Some(10), volts };
        let layout = SkinLayout::new(2, 2, 15e-3, 10e-3).unwrap();
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 4);
        let recording = Recording::new(RecordingInfo::new(layout, weights, 1e3), vec![block]).unwrap();
        assert_eq!(onset_frame(&recording, 0), Some(20));
    }
}
