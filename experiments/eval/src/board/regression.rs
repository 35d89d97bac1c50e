//! A board against an earlier one.

use super::rows::{BoardRow, ScoreBoard};
use crate::place::PlaceRow;
use crate::sensing::Sensing;
use serde::Serialize;

/// A score that is lower than in an earlier score table, or is not there any more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Regression {
    /// Decoder and conditions.
    pub what: String,
    /// Score.
    pub score: &'static str,
    /// Its value on the earlier board.
    pub before: f64,
    /// Its value now; `None` when the row or the score is gone.
    pub now: Option<f64>,
}

type ScoreColumn<T> = (&'static str, fn(&T) -> Option<f64>);

const SCORES: &[ScoreColumn<BoardRow>] = &[
    ("support", |r| r.scores.support),
    ("iou", |r| r.scores.iou),
    ("f1", |r| r.scores.f1),
    ("class_single", |r| r.scores.class_single),
    ("class_vote20", |r| r.scores.class_vote20),
    ("class_evidence", |r| r.scores.class_evidence),
];

const PLACES: &[ScoreColumn<PlaceRow>] = &[
    // a distance is better when it is smaller
    ("mean_px", |r| Some(-r.mean_px)),
    ("share_under_1px", |r| Some(r.share_under_1px)),
];

/// Scores of `before` that are worse in `now` by more than `tolerance`, or gone. What only `now` has does not count,
/// and times never do.
#[must_use]
pub fn regressions(before: &ScoreBoard, now: &ScoreBoard, tolerance: f64) -> Vec<Regression> {
    let mut found = Vec::new();
    for old in &before.rows {
        let new = now.row_like(old);
        let kind = if old.left_out { ", left out" } else { "" };
        let rows = of_rows(old.sensing);
        let what = format!("{} at M = {} from {}{kind}{rows}", old.decoder, old.m, old.learned_from);
        compare(SCORES, &what, old, new, tolerance, &mut found);
    }
    for old in &before.localisation {
        let key = |r: &PlaceRow| (r.m, r.relabelled, r.sensing);
        let named = |r: &PlaceRow| r.decoder == old.decoder && r.contact == old.contact;
        let same = |r: &&PlaceRow| named(r) && key(r) == key(old);
        let kind = if old.relabelled { ", relabelled" } else { "" };
        let rows = of_rows(old.sensing);
        let what = format!(
            "place of {} by {} at M = {}{kind}{rows}",
            old.contact, old.decoder, old.m
        );
        compare(
            PLACES,
            &what,
            old,
            now.localisation.iter().find(same),
            tolerance,
            &mut found,
        );
    }
    found
}

/// Says which rows, where they are not those that follow each other.
fn of_rows(sensing: Sensing) -> &'static str {
    match sensing {
        Sensing::Random => "",
        Sensing::Chosen => ", chosen rows",
    }
}

fn compare<T>(
    scores: &[ScoreColumn<T>],
    what: &str,
    old: &T,
    new: Option<&T>,
    tolerance: f64,
    found: &mut Vec<Regression>,
) {
    for (score, get) in scores {
        let Some(before) = get(old) else { continue };
        let now = new.and_then(get);
        // not `<`: a NaN is a regression, too
        if !now.is_some_and(|now| now >= before - tolerance) {
            found.push(Regression {
                what: what.to_owned(),
                score,
                before: before.abs(),
                now: now.map(f64::abs),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tally::Scores;

    fn board(iou: f64, mean_px: f64) -> ScoreBoard {
        ScoreBoard {
            rows: vec![BoardRow {
                decoder: "omp".to_owned(),
                m: 20,
                left_out: false,
                learned_from: "published".to_owned(),
                sensing: Sensing::Random,
                scores: Scores {
                    support: Some(0.9),
                    iou: Some(iou),
                    f1: Some(0.8),
                    ..Scores::default()
                },
                support_ci: None,
                iou_ci: None,
                class_single_ci: None,
                decode_us: Some(1e9 * iou),
                acquire_us: 311.0,
                too_slow: None,
                failed: 0,
            }],
            localisation: vec![PlaceRow {
                contact: "ball".to_owned(),
                decoder: "blob".to_owned(),
                m: 10,
                relabelled: true,
                sensing: Sensing::Random,
                mean_px,
                share_under_1px: 0.9,
            }],
            objects: Vec::new(),
            slips: Vec::new(),
        }
    }

    #[test]
    fn what_fell_beyond_the_tolerance_is_named() {
        let before = board(0.7, 0.5);
        assert_eq!(regressions(&before, &before, 0.0), []);
        assert_eq!(regressions(&before, &board(0.696, 0.504), 0.005), []);
        assert_eq!(regressions(&before, &board(0.9, 0.1), 0.0), []);
        let found = regressions(&before, &board(0.69, 0.6), 0.005);
        let scores: Vec<_> = found.iter().map(|r| (r.score, r.before, r.now)).collect();
        assert_eq!(scores, [("iou", 0.7, Some(0.69)), ("mean_px", 0.5, Some(0.6))]);
        assert_eq!(regressions(&before, &board(f64::NAN, 0.5), 0.5).len(), 1);
        // rows that are gone: three scores of images that are there, two of the place
        assert_eq!(regressions(&before, &ScoreBoard::default(), 1.0).len(), 5);
        assert_eq!(regressions(&ScoreBoard::default(), &before, 0.0), []);
    }
}
