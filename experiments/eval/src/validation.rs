//! The results of the published evaluation: every object, every published decoding variant, every M.

use crate::algorithm::DecodeError;
use crate::decoders::TrainedDecoder;
use crate::scorer::{ScoredPress, Scorer};
use crate::session::ScoredSession;
use crate::tally::{Scores, Tally, pool};
use crate::unique;
use rayon::prelude::*;
use serde::Serialize;

/// Scores of one object with one decoding variant and M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreRow {
    /// Object, or "mean".
    pub object: String,
    /// Decoding variant, or "raster" for the control.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Support accuracy.
    pub support: f64,
    /// Intersection over union of the supports.
    pub iou: f64,
    /// F1 of the supports.
    pub f1: f64,
    /// Balanced accuracy of the supports.
    pub balanced_accuracy: f64,
    /// Share of single windows classified correctly.
    pub class_single: f64,
    /// Share of votes of 20 windows classified correctly.
    pub class_vote20: f64,
    /// Share of correct votes with a list of decisions that is never cleared within a press, as in the published
    /// script.
    pub class_cumulative: f64,
}

impl ScoreRow {
    /// The scores of `session`; `None` when a score is missing, as without a window.
    pub(crate) fn new(session: &ScoredSession, decode: &'static str, m: usize, scores: &Scores) -> Option<Self> {
        Some(Self {
            object: session.title().to_owned(),
            decode,
            m,
            support: scores.support?,
            iou: scores.iou?,
            f1: scores.f1?,
            balanced_accuracy: scores.balanced_accuracy?,
            class_single: scores.class_single?,
            class_vote20: scores.class_vote20?,
            class_cumulative: scores.class_cumulative?,
        })
    }
}

/// Scores every press of the compressive recording of `session` at every M with every decoder, each beside its name.
/// Presses run in parallel; the result does not depend on the number of threads. `done` is called after every press.
///
/// # Errors
/// [`DecodeError::External`] alone.
pub fn score_session(
    session: &ScoredSession,
    decoders: &[(&'static str, TrainedDecoder)],
    measurements: &[usize],
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ScoreRow>, DecodeError> {
    let each = |(decode, decoder)| measurements.iter().map(move |&m| (decode, decoder, m));
    let keys: Vec<(&'static str, &TrainedDecoder, usize)> =
        decoders.iter().map(|(d, t)| (*d, t)).flat_map(each).collect();
    let presses: Vec<Vec<Tally>> = session
        .scored()
        .into_par_iter()
        .filter_map(|block| ScoredPress::new(session, block))
        .map(|press| {
            let score = |(_, decoder, m): &(&'static str, &TrainedDecoder, usize)| {
                Scorer::new(decoder).score(&press, *m, Some(session.label))
            };
            let tallies = keys.iter().map(score).collect();
            done();
            tallies
        })
        .collect::<Result<_, DecodeError>>()?;
    let row = |(k, (decode, _, m)): (usize, &(&'static str, &TrainedDecoder, usize))| {
        ScoreRow::new(session, decode, *m, &pool(presses.iter().map(|p| &p[k])))
    };
    Ok(keys.iter().enumerate().filter_map(row).collect())
}

/// Mean over all objects for every decoding variant and M, in the order of the first object's rows.
#[must_use]
pub fn mean_rows(rows: &[ScoreRow]) -> Vec<ScoreRow> {
    let keys = unique(rows.iter().map(|row| (row.decode, row.m)));
    keys.into_iter()
        .map(|(decode, m)| {
            let members: Vec<&ScoreRow> = rows.iter().filter(|r| r.decode == decode && r.m == m).collect();
            let mean = |get: fn(&ScoreRow) -> f64| members.iter().map(|r| get(r)).sum::<f64>() / members.len() as f64;
            ScoreRow {
                object: "mean".to_owned(),
                decode,
                m,
                support: mean(|r| r.support),
                iou: mean(|r| r.iou),
                f1: mean(|r| r.f1),
                balanced_accuracy: mean(|r| r.balanced_accuracy),
                class_single: mean(|r| r.class_single),
                class_vote20: mean(|r| r.class_vote20),
                class_cumulative: mean(|r| r.class_cumulative),
            }
        })
        .collect()
}
