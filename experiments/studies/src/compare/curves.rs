//! Score curves of the twin's replayed sessions, compared with the skin's.

use super::{ComparedSession, split};
use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::decoders::PublishedDecode;
use spts_eval::protocol::Protocol;
use spts_eval::{PublishedSkin, ScoreError, ScoreRow, ScoredSession, mean_rows, score_session};

/// Numbers of measurements of the comparison.
pub const MEASUREMENTS: [usize; 11] = [7, 10, 13, 15, 20, 25, 30, 40, 50, 75, 100];

/// A score of a row: name, largest mean |twin − real| allowed, value.
type Metric = (&'static str, f64, fn(&ScoreRow) -> f64);

/// Scores that are compared.
const METRICS: [Metric; 3] = [
    ("support", 0.02, |r| r.support),
    ("iou", 0.06, |r| r.iou),
    ("class_vote20", 0.05, |r| r.class_vote20),
];

/// How far the twin's curve of a score over M is from the real skin's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveDistance {
    /// Score.
    pub metric: &'static str,
    /// Decoding variant.
    pub decode: &'static str,
    /// Mean over [`MEASUREMENTS`] of |twin − real|, each the mean over the objects.
    pub mean_abs_difference: f64,
    /// Largest |twin − real|.
    pub max_abs_difference: f64,
    /// Largest allowed mean difference.
    pub tolerance: f64,
    /// Whether the mean difference is allowed.
    pub ok: bool,
}

/// Score curves, and the rows from which they are computed.
#[derive(Debug, Clone)]
pub struct ScoreCurves {
    /// Distances.
    pub distances: Vec<CurveDistance>,
    /// Mean rows of the skin.
    pub real: Vec<ScoreRow>,
    /// Mean rows of the twin.
    pub twin: Vec<ScoreRow>,
}

/// Number of progress reports of [`curves`].
#[must_use]
pub fn steps(compared: &[ComparedSession], real: &PublishedSkin) -> usize {
    2 * compared
        .iter()
        .filter_map(|c| {
            let session = real.skin.sessions.iter().find(|s| s.name == c.real.session)?;
            compared_only(&c.recording, &session.protocol)
        })
        .map(|(recording, _)| recording.blocks().len())
        .sum::<usize>()
}

/// The presses of `recording` that `protocol` scores and the readout was not calibrated on, and a protocol that scores
/// them all. `None` when there are none.
fn compared_only(recording: &Recording, protocol: &Protocol) -> Option<(Recording, Protocol)> {
    let scored = protocol.presses_of(recording);
    let (_, compared) = split(recording)?;
    let blocks: Vec<_> = compared
        .into_iter()
        .filter(|block| scored.contains(block))
        .map(|block| recording.blocks()[block].clone())
        .collect();
    let protocol = Protocol {
        first_press: 0,
        presses: blocks.len(),
        ..*protocol
    };
    Some((recording.with_blocks(blocks).ok()?, protocol))
}

/// Scores the compared sessions of both skins, on presses of the protocol that were not used for calibration. True
/// images, dictionary and library are the published ones for both: the ground truth is the skin's own raster session.
///
/// # Errors
/// [`ScoreError`] if the published dictionary or library is not usable.
pub fn curves(
    compared: &[ComparedSession],
    real: &PublishedSkin,
    done: &(dyn Fn() + Sync),
) -> Result<ScoreCurves, ScoreError> {
    let decoders = PublishedDecode::named(&real.skin.learned).map_err(ScoreError::from)?;
    let score = |is_twin: bool| {
        let mut rows = Vec::new();
        for c in compared {
            let Some(session) = real.skin.sessions.iter().find(|s| s.name == c.real.session) else {
                continue;
            };
            let recording = if is_twin {
                Some(&c.recording)
            } else {
                session.compressive.as_ref()
            };
            let Some((compressive, protocol)) = recording.and_then(|r| compared_only(r, &session.protocol)) else {
                continue;
            };
            let session = ScoredSession {
                compressive: Some(compressive),
                protocol,
                ..session.clone()
            };
            rows.extend(score_session(&session, &decoders, &MEASUREMENTS, done)?);
        }
        Ok::<_, ScoreError>(mean_rows(&rows))
    };
    let (skin, twin) = (score(false)?, score(true)?);
    Ok(ScoreCurves {
        distances: distances(&skin, &twin),
        real: skin,
        twin,
    })
}

fn distances(real: &[ScoreRow], twin: &[ScoreRow]) -> Vec<CurveDistance> {
    let mut decodes: Vec<&'static str> = real.iter().map(|r| r.decode).collect();
    decodes.dedup();
    let mut out = Vec::new();
    for decode in decodes {
        for (metric, tolerance, get) in METRICS {
            let pairs = real.iter().filter(|r| r.decode == decode).filter_map(|r| {
                let t = twin.iter().find(|t| t.decode == decode && t.m == r.m)?;
                Some((get(t) - get(r)).abs())
            });
            let gaps: Vec<f64> = pairs.collect();
            let mean_abs_difference = gaps.iter().sum::<f64>() / gaps.len() as f64;
            out.push(CurveDistance {
                metric,
                decode,
                mean_abs_difference,
                max_abs_difference: gaps.iter().copied().fold(0.0, f64::max),
                tolerance,
                ok: mean_abs_difference <= tolerance,
            });
        }
    }
    out
}
