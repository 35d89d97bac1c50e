//! The board as text tables.

use super::rows::{BoardRow, ObjectRow, ScoreBoard};
use crate::decoders::short_label;
use crate::place::locator_label;
use crate::sensing::Sensing;
use crate::training::{PUBLISHED, RASTER};
use crate::unique;

/// The board as tables: rows with known and with left-out objects, then places, then single objects at the largest M up
/// to 20.
#[must_use]
pub fn table(board: &ScoreBoard) -> String {
    let mut out = String::new();
    for left_out in [false, true] {
        let rows: Vec<&BoardRow> = board.rows.iter().filter(|r| r.left_out == left_out).collect();
        if rows.is_empty() {
            continue;
        }
        out.push_str(if left_out {
            "\nleft out: the object was not learned from\n"
        } else {
            "objects that were learned from\n"
        });
        out.push_str(&format!(
            "{:<22} {:<11} {:<6} {:>4}  {:>7} {:>6} {:>13} {:>6}  {:>6} {:>7} {:>8}  {:>10} {:>9}\n",
            "decoder",
            "learned",
            "rows",
            "M",
            "support",
            "IoU",
            "(95 %)",
            "F1",
            "single",
            "vote20",
            "evidence",
            "decode µs",
            "window µs"
        ));
        let mut last = "";
        for row in rows {
            if !last.is_empty() && last != row.decoder {
                out.push('\n');
            }
            last = &row.decoder;
            out.push_str(&line(row));
        }
    }
    out.push_str("\nclasses: share correct of single windows, of votes of 20, of evidence added over 20; support counts every taxel, so that an empty image is right about all that is not touched\n");
    if board.rows.iter().any(|r| r.sensing == Sensing::Chosen) {
        out.push_str("chosen rows: picked from those of a press for what was learned, before a sample is seen; their order in time is lost, and there are no votes\n");
    }
    if !board.localisation.is_empty() {
        out.push_str("\nplace of contacts\n");
        out.push_str(&format!(
            "{:<15} {:<19} {:<12} {:<6} {:>4}  {:>8} {:>11}\n",
            "contact", "locator", "taxels", "rows", "M", "mean px", "under 1 px"
        ));
    }
    for row in &board.localisation {
        let taxels = if row.relabelled { "relabelled" } else { "as recorded" };
        out.push_str(&format!(
            "{:<15} {:<19} {:<12} {:<6} {:>4}  {:>8.2} {:>11.3}\n",
            shorten(&row.contact, 15),
            locator_label(&row.decoder),
            taxels,
            row.sensing.name(),
            row.m,
            row.mean_px,
            row.share_under_1px
        ));
    }
    out.push_str(&objects(board));
    out.push_str(&gaps(board));
    out.truncate(out.trim_end().len());
    out
}

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.3}"))
}

fn line(row: &BoardRow) -> String {
    let s = &row.scores;
    let time = row.decode_us.map_or_else(|| "–".to_owned(), |us| format!("{us:.1}"));
    let slow = if row.too_slow == Some(true) { " TOO SLOW" } else { "" };
    let failed = if row.failed > 0 {
        format!(" ({} windows failed)", row.failed)
    } else {
        String::new()
    };
    format!(
        "{:<22} {:<11} {:<6} {:>4}  {:>7} {:>6} {:>13} {:>6}  {:>6} {:>7} {:>8}  {:>10} {:>9.0}{slow}{failed}\n",
        shorten(short_label(&row.decoder), 22),
        shorten(&row.learned_from, 11),
        row.sensing.name(),
        row.m,
        share(s.support),
        share(s.iou),
        row.iou_ci
            .map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.3}–{high:.3}")),
        share(s.f1),
        share(s.class_single),
        share(s.class_vote20),
        share(s.class_evidence),
        time,
        row.acquire_us,
    )
}

/// The name, cut to `most` characters.
fn shorten(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        return name.to_owned();
    }
    let start: String = name.chars().take(most - 1).collect();
    format!("{start}…")
}

/// IoU and single windows, object by object, at one M.
fn objects(board: &ScoreBoard) -> String {
    let names = unique(board.objects.iter().map(|row| row.object.as_str()));
    let (Some(m), true) = (shown_m(board), names.len() > 1) else {
        return String::new();
    };
    let mut out = format!("\nobject by object at M = {m}: IoU / single windows\n{:<41}", "");
    names.iter().for_each(|name| out.push_str(&format!(" {name:>11}")));
    out.push('\n');
    for row in board.rows.iter().filter(|r| r.m == m) {
        let kind = if row.left_out {
            "left out".to_owned()
        } else {
            shorten(&row.learned_from, 11)
        };
        let name = shorten(short_label(&row.decoder), 22);
        out.push_str(&format!("{name:<22} {kind:<11} {:<6}", row.sensing.name()));
        let same = board.objects.iter().filter(|o| {
            let conditions = (o.m, o.left_out, o.sensing) == (m, row.left_out, row.sensing);
            conditions && o.decoder == row.decoder && o.learned_from == row.learned_from
        });
        for object in same {
            let class = object
                .scores
                .class_single
                .map_or_else(|| "    –".to_owned(), |v| format!("{v:.3}"));
            let iou = object.scores.iou;
            let iou = iou.map_or_else(|| "   –".to_owned(), |v| format!("{v:.2}"));
            out.push_str(&format!("  {iou}/{class}"));
        }
        out.push('\n');
    }
    out
}

/// What learning from elsewhere costs beside learning from the recordings' own raster presses, object by object, at one
/// M.
fn gaps(board: &ScoreBoard) -> String {
    let Some(m) = shown_m(board) else {
        return String::new();
    };
    let elsewhere = |r: &&ObjectRow| r.m == m && ![RASTER, PUBLISHED, "nothing"].contains(&r.learned_from.as_str());
    let mut out = String::new();
    for row in board.objects.iter().filter(elsewhere) {
        let same = |o: &&ObjectRow| {
            o.m == m
                && o.decoder == row.decoder
                && o.left_out == row.left_out
                && o.learned_from == RASTER
                && o.sensing == row.sensing
                && o.object == row.object
        };
        let Some(own) = board.objects.iter().find(same) else {
            continue;
        };
        if out.is_empty() {
            out = format!("\ngap to learning from {RASTER} at M = {m}\n");
            out.push_str(&format!(
                "{:<22} {:<20} {:<10} {:>7} {:>8}\n",
                "decoder", "learned from", "object", "IoU", "single"
            ));
        }
        let (a, b) = (&own.scores, &row.scores);
        let gap = |own: Option<f64>, other: Option<f64>| {
            let both = own.zip(other);
            both.map_or_else(|| "–".to_owned(), |(own, other)| format!("{:+.3}", other - own))
        };
        let (iou, single) = (gap(a.iou, b.iou), gap(a.class_single, b.class_single));
        let name = shorten(short_label(&row.decoder), 22);
        out.push_str(&format!(
            "{name:<22} {:<20} {:<10} {iou:>7} {single:>8}\n",
            row.learned_from, row.object
        ));
    }
    out
}

/// The M of the tables by object: the largest up to 20.
fn shown_m(board: &ScoreBoard) -> Option<usize> {
    board.rows.iter().map(|r| r.m).filter(|m| *m <= 20).max()
}
