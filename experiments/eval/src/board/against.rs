//! Compares what two score tables have scored: their objects, decoders, numbers of measurements and so on.

use super::{RowKey, ScoreBoard};
use crate::place::PlaceRow;
use crate::sensing::Sensing;
use crate::tally::{ScoreColumn, Scores, unique};
use serde::Serialize;

/// Names of one kind, such as decoders, that only one of two score tables has. Where there are any, means of the two
/// tables are not over the same things.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// What is named, in the plural, such as "decoders" or "numbers of measurements".
    pub what: &'static str,
    /// Names that only the earlier score table has.
    pub only_before: Vec<String>,
    /// Names that only the score table of this run has.
    pub only_now: Vec<String>,
}

type Names = fn(&ScoreBoard) -> Vec<String>;

/// What is compared, in the order in which it is told.
const KINDS: &[(&str, Names)] = &[
    ("objects", |b| b.objects.iter().map(|o| o.object.clone()).collect()),
    ("decoders", |b| b.rows.iter().map(|r| r.key.decoder.clone()).collect()),
    ("numbers of measurements", |b| b.rows.iter().map(|r| r.key.m.to_string()).collect()),
    ("training data", |b| b.rows.iter().map(|r| r.key.learned_from.clone()).collect()),
    ("scores", |b| b.rows.iter().map(|r| left_out(&r.key).to_owned()).collect()),
    ("rows of a window", |b| b.rows.iter().map(|r| r.key.sensing.name().to_owned()).collect()),
    ("places of", |b| b.localisation.iter().map(|r| r.contact.clone()).collect()),
    ("locators", |b| b.localisation.iter().map(|r| r.decoder.clone()).collect()),
    ("numbers of measurements of places", |b| b.localisation.iter().map(|r| r.m.to_string()).collect()),
];

fn left_out(key: &RowKey) -> &'static str {
    if key.left_out { "of objects left out of the training data" } else { "of objects in the training data" }
}

/// The kinds of names that differ between the score tables `before` and `now`; empty for two tables of the same
/// settings.
///
/// ```
/// use spts_eval::board::{ScoreBoard, differences};
///
/// let board = ScoreBoard::default();
/// assert!(differences(&board, &board).is_empty());
/// ```
pub fn differences(before: &ScoreBoard, now: &ScoreBoard) -> Vec<Difference> {
    let kinds = KINDS.iter().map(|(what, names)| {
        let (before, now) = (names(before), names(now));
        Difference { what, only_before: without(&before, &now), only_now: without(&now, &before) }
    });
    kinds.filter(|kind| !kind.only_before.is_empty() || !kind.only_now.is_empty()).collect()
}

/// The names in `these` that `those` lack, each once.
fn without(these: &[String], those: &[String]) -> Vec<String> {
    unique(these.iter().filter(|name| !those.contains(name)).cloned())
}

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

const PLACES: &[ScoreColumn<PlaceRow>] = &[
    // a distance is better when it is smaller
    ("mean_px", |r| Some(-r.mean_px)),
    ("share_under_1px", |r| Some(r.share_under_1px)),
];

/// Scores of `before` that are worse in `now` by more than `tolerance`, or gone. What only `now` has does not count,
/// and times never do.
pub fn regressions(before: &ScoreBoard, now: &ScoreBoard, tolerance: f64) -> Vec<Regression> {
    let mut found = Vec::new();
    for old in &before.rows {
        let RowKey { decoder, m, learned_from, .. } = &old.key;
        let kind = if old.key.left_out { ", left out" } else { "" };
        let what = format!("{decoder} at M = {m} from {learned_from}{kind}{}", chosen(old.key.sensing));
        let new = now.row_like(&old.key).map(|row| &row.scores);
        compare(&Scores::COLUMNS, &what, &old.scores, new, tolerance, &mut found);
    }
    for old in &before.localisation {
        let key = |r: &PlaceRow| (r.m, r.relabelled, r.sensing);
        let named = |r: &PlaceRow| r.decoder == old.decoder && r.contact == old.contact;
        let new = now.localisation.iter().find(|r| named(r) && key(r) == key(old));
        let kind = if old.relabelled { ", relabelled" } else { "" };
        let rows = chosen(old.sensing);
        let what = format!("place of {} by {} at M = {}{kind}{rows}", old.contact, old.decoder, old.m);
        compare(PLACES, &what, old, new, tolerance, &mut found);
    }
    found
}

/// Says which rows, where they are not those that follow each other.
fn chosen(sensing: Sensing) -> &'static str {
    match sensing {
        Sensing::Random => "",
        Sensing::Chosen => ", chosen rows",
        Sensing::WorstKind => ", rows chosen for the worst kind",
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
            found.push(Regression { what: what.to_owned(), score, before: before.abs(), now: now.map(f64::abs) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{BoardRow, ObjectRow};

    fn key(decoder: &str, m: usize) -> RowKey {
        RowKey {
            decoder: decoder.to_owned(),
            m,
            left_out: false,
            learned_from: "raster".to_owned(),
            sensing: Sensing::Random,
        }
    }

    fn row(decoder: &str, m: usize, scores: Scores) -> BoardRow {
        BoardRow {
            key: key(decoder, m),
            scores,
            look_up: false,
            worst_object: None,
            worst_iou: None,
            support_ci: None,
            iou_ci: None,
            class_single_ci: None,
            decode_us: scores.iou.map(|iou| 1e9 * iou),
            acquire_us: 311.0,
            too_slow: None,
            failed: 0,
        }
    }

    #[test]
    fn what_only_one_board_has_is_named_once() {
        let board = |cells: &[(&str, &str, usize)]| {
            let objects = cells.iter().map(|(object, decoder, m)| ObjectRow {
                key: key(decoder, *m),
                object: (*object).to_owned(),
                truth: None,
                scores: Scores::default(),
                iou_ci: None,
                class_single_ci: None,
            });
            let rows = cells.iter().map(|(_, decoder, m)| row(decoder, *m, Scores::default()));
            ScoreBoard { objects: objects.collect(), rows: rows.collect(), ..ScoreBoard::default() }
        };
        let before = board(&[("T", "omp", 7), ("T", "omp", 20), ("rec", "omp", 20)]);
        let found = differences(&before, &board(&[("T", "omp", 20), ("T", "evidence", 20)]));
        let found = found.iter().map(|d| (d.what, d.only_before.join(","), d.only_now.join(",")));
        let expected = [("objects", "rec", ""), ("decoders", "", "evidence"), ("numbers of measurements", "7", "")];
        let expected = expected.map(|(what, a, b)| (what, a.to_owned(), b.to_owned()));
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }

    fn board(iou: f64, mean_px: f64) -> ScoreBoard {
        let scores = Scores { support: Some(0.9), iou: Some(iou), f1: Some(0.8), ..Scores::default() };
        ScoreBoard {
            rows: vec![row("omp", 20, scores)],
            localisation: vec![PlaceRow {
                contact: "ball".to_owned(),
                decoder: "blob".to_owned(),
                m: 10,
                relabelled: true,
                sensing: Sensing::Random,
                mean_px,
                share_under_1px: 0.9,
            }],
            ..ScoreBoard::default()
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
