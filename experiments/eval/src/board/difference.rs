//! Compares what two score tables have scored: their objects, decoders, numbers of measurements and so on.

use super::rows::{BoardRow, ScoreBoard};
use crate::place::PlaceRow;
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
    ("decoders", |b| of_rows(b, |row| row.decoder.clone())),
    ("numbers of measurements", |b| of_rows(b, |row| row.m.to_string())),
    ("training data", |b| of_rows(b, |row| row.learned_from.clone())),
    ("scores", |b| of_rows(b, |row| left_out(row).to_owned())),
    ("rows of a window", |b| of_rows(b, |row| row.sensing.name().to_owned())),
    ("places of", |b| of_places(b, |row| row.contact.clone())),
    ("locators", |b| of_places(b, |row| row.decoder.clone())),
    ("numbers of measurements of places", |b| {
        of_places(b, |row| row.m.to_string())
    }),
];

fn of_rows(board: &ScoreBoard, name: fn(&BoardRow) -> String) -> Vec<String> {
    board.rows.iter().map(name).collect()
}

fn of_places(board: &ScoreBoard, name: fn(&PlaceRow) -> String) -> Vec<String> {
    board.localisation.iter().map(name).collect()
}

fn left_out(row: &BoardRow) -> &'static str {
    if row.left_out {
        "of objects left out of the training data"
    } else {
        "of objects in the training data"
    }
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
#[must_use]
pub fn differences(before: &ScoreBoard, now: &ScoreBoard) -> Vec<Difference> {
    let kinds = KINDS.iter().map(|(what, names)| {
        let (before, now) = (names(before), names(now));
        Difference {
            what,
            only_before: without(&before, &now),
            only_now: without(&now, &before),
        }
    });
    kinds
        .filter(|kind| !kind.only_before.is_empty() || !kind.only_now.is_empty())
        .collect()
}

/// The names in `these` that `those` lack, each once.
fn without(these: &[String], those: &[String]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in these {
        if !those.contains(name) && !found.contains(name) {
            found.push(name.clone());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::ObjectRow;
    use crate::sensing::Sensing;
    use crate::tally::Scores;

    fn board(cells: &[(&str, &str, usize)]) -> ScoreBoard {
        let objects = cells.iter().map(|(object, decoder, m)| ObjectRow {
            decoder: (*decoder).to_owned(),
            m: *m,
            left_out: false,
            learned_from: "raster".to_owned(),
            sensing: Sensing::Random,
            object: (*object).to_owned(),
            scores: Scores::default(),
            iou_ci: None,
            class_single_ci: None,
        });
        let rows = cells.iter().map(|(_, decoder, m)| BoardRow {
            decoder: (*decoder).to_owned(),
            m: *m,
            left_out: false,
            learned_from: "raster".to_owned(),
            sensing: Sensing::Random,
            scores: Scores::default(),
            support_ci: None,
            iou_ci: None,
            class_single_ci: None,
            decode_us: None,
            acquire_us: 311.0,
            too_slow: None,
            failed: 0,
        });
        ScoreBoard {
            rows: rows.collect(),
            objects: objects.collect(),
            ..ScoreBoard::default()
        }
    }

    #[test]
    fn what_only_one_board_has_is_named_once() {
        let before = board(&[("T", "omp", 7), ("T", "omp", 20), ("rec", "omp", 20)]);
        let now = board(&[("T", "omp", 20), ("T", "evidence", 20)]);
        let found = differences(&before, &now);
        let found: Vec<_> = found
            .iter()
            .map(|d| (d.what, d.only_before.join(","), d.only_now.join(",")))
            .collect();
        let text = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let expected = [
            ("objects", text("rec", "")),
            ("decoders", text("", "evidence")),
            ("numbers of measurements", text("7", "")),
        ];
        assert_eq!(found, expected.map(|(what, (a, b))| (what, a, b)));
    }
}
