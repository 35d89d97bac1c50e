//! Results as text tables.

use super::rows::{ContactKind, InTimeBoard, InTimeRow};
use super::tally::Interval;
use crate::decoders::short_label;
use crate::unique;

/// One table for presses and one for drops, with a line for every decoder, number of samples and moment; then objects
/// during the hold and at the first moments of the rise.
#[must_use]
pub fn table(board: &InTimeBoard) -> String {
    let mut out = String::new();
    for (kind, title) in [
        (ContactKind::Press, "presses: IoU of windows alone and in time"),
        (
            ContactKind::Drop,
            "drops of the ball: IoU, and distance of its place in taxels",
        ),
    ] {
        let rows: Vec<&InTimeRow> = board.rows.iter().filter(|row| row.contact == kind).collect();
        if rows.is_empty() {
            continue;
        }
        out.push_str(&format!("\n{title}\n{}", head(kind)));
        let mut last = None;
        for row in rows {
            let group = (&row.decoder, &row.learned_from, row.left_out, row.m);
            if last.is_some_and(|last| last != group) {
                out.push('\n');
            }
            last = Some(group);
            out.push_str(&line(row));
        }
    }
    out.push_str(
        "\nalone: the decoder by the last window alone; longer: by as many of the last samples as there are taxels; in \
         time: all windows since before the touch, the older the less\n",
    );
    out.push_str(&objects(board));
    out.truncate(out.trim_end().len());
    out.trim_start().to_owned()
}

fn head(kind: ContactKind) -> String {
    let more = match kind {
        ContactKind::Press => String::new(),
        ContactKind::Drop => format!(" {:>7} {:>7} {:>7} {:>15}", "alone", "longer", "in time", "gain (95 %)"),
    };
    format!(
        "{:<20} {:<11} {:>4} {:>8}  {:>6} {:>11} {:>7} {:>7} {:>11} {:>6} {:>13}{more}\n",
        "decoder", "learned", "M", "time", "alone", "(95 %)", "longer", "in time", "(95 %)", "gain", "(95 %)"
    )
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.2}"))
}

fn interval(value: Interval) -> String {
    value.map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.2}–{high:.2}"))
}

/// Time since the touch, or that the contact is steady.
fn moment(since_touch_s: Option<f64>) -> String {
    since_touch_s.map_or_else(|| "hold".to_owned(), |time_s| format!("{:.0} ms", 1e3 * time_s))
}

fn learned(row: &InTimeRow) -> String {
    let out = if row.left_out { ", out" } else { "" };
    format!("{}{out}", row.learned_from)
}

fn line(row: &InTimeRow) -> String {
    let s = &row.scores;
    let more = match row.contact {
        ContactKind::Press => String::new(),
        ContactKind::Drop => format!(
            " {:>7} {:>7} {:>7} {:>15}",
            number(s.error_alone_px),
            number(s.error_longer_px),
            number(s.error_in_time_px),
            interval(s.error_gain_ci),
        ),
    };
    format!(
        "{:<20} {:<11} {:>4} {:>8}  {:>6} {:>11} {:>7} {:>7} {:>11} {:>6} {:>13}{more}\n",
        short_label(&row.decoder),
        learned(row),
        row.m,
        moment(row.since_touch_s),
        number(s.iou_alone),
        interval(s.iou_alone_ci),
        number(s.iou_longer),
        number(s.iou_in_time),
        interval(s.iou_in_time_ci),
        number(s.iou_gain),
        interval(s.iou_gain_ci),
    )
}

/// Alone and in time, object by object.
fn objects(board: &InTimeBoard) -> String {
    let names = unique(board.objects.iter().map(|object| object.object.as_str()));
    if names.len() < 2 {
        return String::new();
    }
    let mut out = format!("\nobject by object: alone / in time (95 %)\n{:<46}", "");
    names.iter().for_each(|name| out.push_str(&format!(" {name:>23}")));
    out.push('\n');
    for row in board.rows.iter().filter(|row| row.contact == ContactKind::Press) {
        out.push_str(&format!(
            "{:<20} {:<11} {:>4} {:>8}",
            short_label(&row.decoder),
            learned(row),
            row.m,
            moment(row.since_touch_s)
        ));
        let key = |row: &InTimeRow| {
            let way = (row.decoder.clone(), row.learned_from.clone(), row.left_out);
            (way, row.m, row.since_touch_s.map(f64::to_bits))
        };
        for name in &names {
            let same = board.objects.iter();
            let same = same.filter(|object| object.object == *name && key(&object.row) == key(row));
            let text = same.map(|object| {
                let s = &object.row.scores;
                let (alone, in_time) = (number(s.iou_alone), number(s.iou_in_time));
                format!("{alone} / {in_time} ({})", interval(s.iou_in_time_ci))
            });
            out.push_str(&format!(" {:>23}", text.collect::<String>()));
        }
        out.push('\n');
    }
    out
}
