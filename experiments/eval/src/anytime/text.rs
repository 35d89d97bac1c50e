//! Results as text tables.

use super::rows::{AnytimeBoard, AnytimeRow};
use crate::algorithm::Subject;
use crate::decoders::short_label;
use crate::sensing::Sensing;
use crate::unique;

/// Tables of classes, of images of known objects, and of images of left-out objects, with one line for every stopping
/// rule; then a table of objects.
#[must_use]
pub fn table(board: &AnytimeBoard) -> String {
    let mut out = String::new();
    for (subject, left_out) in [(Subject::Class, false), (Subject::Image, false), (Subject::Image, true)] {
        let here = |r: &&AnytimeRow| r.subject == subject && r.left_out == left_out;
        let rows: Vec<&AnytimeRow> = board.rows.iter().filter(here).collect();
        if rows.is_empty() {
            continue;
        }
        out.push_str(match (subject, left_out) {
            (Subject::Class, _) => "\nclass: stop when the most probable class has the wanted probability\n",
            (Subject::Image, false) => "\nimage, objects that were learned from: stop at the wanted expected IoU\n",
            (Subject::Image, true) => "\nimage, the object was not learned from: stop at the wanted expected IoU\n",
        });
        out.push_str(&format!(
            "{:<20} {:<11} {:<6} {:>7}  {:>7} {:>11} {:>6} {:>5}  {:>8} {:>13} {:>7} {:>6}\n",
            "decoder",
            "learned",
            "rows",
            "wanted",
            "samples",
            "(95 %)",
            "median",
            "90 %",
            if subject == Subject::Class { "right" } else { "IoU" },
            "(95 %)",
            "stated",
            "never"
        ));
        let mut last = None;
        for row in rows {
            let kind = (&row.decoder, &row.learned_from, row.sensing, row.confidence.is_some());
            if last.is_some_and(|last| last != kind) {
                out.push('\n');
            }
            last = Some(kind);
            out.push_str(&line(row));
        }
    }
    out.push_str("\nwanted: confidence at which a window ends, fixed: all windows take as many samples; stated: mean confidence of the windows that reached it; never: share that did not, which count with all of their samples\n");
    if board.rows.iter().any(|r| r.sensing == Sensing::Chosen) {
        out.push_str("chosen rows: picked from those of a press for what was learned, before a sample is seen; their order in time is lost\n");
    }
    out.push_str(&objects(board));
    out.truncate(out.trim_end().len());
    out.trim_start().to_owned()
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
}

fn interval(value: Option<[f64; 2]>, digits: usize) -> String {
    value.map_or_else(
        || "–".to_owned(),
        |[low, high]| format!("{low:.digits$}–{high:.digits$}"),
    )
}

fn wanted(confidence: Option<f64>) -> String {
    confidence.map_or_else(|| "fixed".to_owned(), |c| format!("{c}"))
}

fn line(row: &AnytimeRow) -> String {
    let s = &row.scores;
    let sure = |value: Option<f64>| number(value.filter(|_| row.confidence.is_some()), 3);
    let failed = if row.failed > 0 {
        format!(" ({} windows failed)", row.failed)
    } else {
        String::new()
    };
    format!(
        "{:<20} {:<11} {:<6} {:>7}  {:>7} {:>11} {:>6} {:>5}  {:>8} {:>13} {:>7} {:>6}{failed}\n",
        short_label(&row.decoder),
        row.learned_from,
        row.sensing.name(),
        wanted(row.confidence),
        number(s.samples, 2),
        interval(row.samples_ci, 1),
        number(s.samples_median, 0),
        number(s.samples_p90, 0),
        number(s.attained, 3),
        interval(row.attained_ci, 3),
        sure(s.stated),
        sure(s.never),
    )
}

/// Samples and what is attained, object by object, of the windows that end with a wanted confidence.
fn objects(board: &AnytimeBoard) -> String {
    let names = unique(board.objects.iter().map(|row| row.object.as_str()));
    let rows: Vec<&AnytimeRow> = board.rows.iter().filter(|r| r.confidence.is_some()).collect();
    if names.len() < 2 || rows.is_empty() {
        return String::new();
    }
    let mut out = format!("\nobject by object: samples / attained\n{:<57}", "");
    names.iter().for_each(|name| out.push_str(&format!(" {name:>11}")));
    out.push('\n');
    for row in rows {
        let kind = if row.left_out { "left out" } else { &row.learned_from };
        out.push_str(&format!(
            "{:<20} {kind:<11} {:<6} {:>7} {:>9}",
            short_label(&row.decoder),
            row.sensing.name(),
            wanted(row.confidence),
            ""
        ));
        let same = board.objects.iter().filter(|o| {
            let way = (o.left_out, o.sensing, o.confidence.map(f64::to_bits))
                == (row.left_out, row.sensing, row.confidence.map(f64::to_bits));
            way && o.decoder == row.decoder && o.learned_from == row.learned_from
        });
        for object in same {
            let (samples, attained) = (number(object.scores.samples, 1), number(object.scores.attained, 3));
            out.push_str(&format!(" {:>11}", format!("{samples}/{attained}")));
        }
        out.push('\n');
    }
    out
}
