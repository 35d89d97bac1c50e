//! Results as files, and as text.

use super::follow::{InTimeScores, MEMORY_S, STRENGTH_MEMORY_S};
use super::{ContactKind, InTimeBoard, InTimeRow};
use crate::decoders::short_label;
use crate::table::{Cell, Table, TextTable};
use crate::tally::{ScoreColumn, unique};
use spts::output::{OutputError, OutputFolder, write_json};

/// Columns of the scores in files.
const SCORES: [ScoreColumn<InTimeScores>; 8] = [
    ("iou_alone", |s| s.iou_alone),
    ("iou_longer", |s| s.iou_longer),
    ("iou_in_time", |s| s.iou_in_time),
    ("iou_gain", |s| s.iou_gain),
    ("error_alone_px", |s| s.error_alone_px),
    ("error_longer_px", |s| s.error_longer_px),
    ("error_in_time_px", |s| s.error_in_time_px),
    ("error_gain_px", |s| s.error_gain_px),
];

/// Writes `in_time.json`, `in_time.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(board: &InTimeBoard, out: &mut OutputFolder) -> Result<(), OutputError> {
    write_json(&out.path("in_time.json"), board)?;
    in_files(Table::new("in_time", &board.rows), |row| row).write(out)?;
    let objects = Table::new("objects", &board.objects).file("object", |o| &o.object);
    in_files(objects, |object| &object.row).write(out)
}

fn in_files<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> &'a InTimeRow + Copy + 'a) -> Table<'a, R> {
    let table = table
        .file("decoder", move |r| &of(r).decoder)
        .file("left_out", move |r| of(r).left_out)
        .file("learned_from", move |r| &of(r).learned_from)
        .file("contact", move |r| of(r).contact.name())
        .file("m", move |r| of(r).m)
        .file("since_touch_s", move |r| of(r).since_touch_s);
    let columns = SCORES.into_iter();
    columns
        .fold(table, |table, (name, get)| {
            table.file(name, move |r| get(&of(r).scores))
        })
        .interval("iou_alone", move |r| of(r).scores.iou_alone_ci)
        .interval("iou_in_time", move |r| of(r).scores.iou_in_time_ci)
        .interval("iou_gain", move |r| of(r).scores.iou_gain_ci)
        .interval("error_gain", move |r| of(r).scores.error_gain_ci)
        .file("contacts", move |r| of(r).contacts)
        .file("memory_s", |_| MEMORY_S)
        .file("strength_memory_s", |_| STRENGTH_MEMORY_S)
}

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
        if !rows.is_empty() {
            out.push_str(&format!("\n{title}\n{}", text(&rows, kind)));
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

fn text(rows: &[&InTimeRow], kind: ContactKind) -> String {
    let mut table = Table::new("", rows.iter().copied())
        .shown("decoder", |r: &InTimeRow| short_label(&r.decoder))
        .shown("learned", learned)
        .shown("M", |r| r.m)
        .shown("time", |r| moment(r.since_touch_s))
        .shown("alone", |r| r.scores.iou_alone)
        .digits(2)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_alone_ci, 2))
        .shown("longer", |r| r.scores.iou_longer)
        .digits(2)
        .shown("in time", |r| r.scores.iou_in_time)
        .digits(2)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_in_time_ci, 2))
        .shown("gain", |r| r.scores.iou_gain)
        .digits(2)
        .shown("(95 %)", |r| Cell::span(r.scores.iou_gain_ci, 2));
    if kind == ContactKind::Drop {
        table = table
            .shown("alone, px", |r| r.scores.error_alone_px)
            .digits(2)
            .shown("longer, px", |r| r.scores.error_longer_px)
            .digits(2)
            .shown("in time, px", |r| r.scores.error_in_time_px)
            .digits(2)
            .shown("gain, px (95 %)", |r| Cell::span(r.scores.error_gain_ci, 2));
    }
    table.text()
}

/// Time since the touch, or that the contact is steady.
fn moment(since_touch_s: Option<f64>) -> String {
    since_touch_s.map_or_else(|| "hold".to_owned(), |time_s| format!("{:.0} ms", 1e3 * time_s))
}

fn learned(row: &InTimeRow) -> String {
    let out = if row.left_out { ", out" } else { "" };
    format!("{}{out}", row.learned_from)
}

/// Alone and in time, object by object.
fn objects(board: &InTimeBoard) -> String {
    let names = unique(board.objects.iter().map(|object| object.object.as_str()));
    if names.len() < 2 {
        return String::new();
    }
    let key = |row: &InTimeRow| {
        let way = (row.decoder.clone(), row.learned_from.clone(), row.left_out);
        (way, row.m, row.since_touch_s.map(f64::to_bits))
    };
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.2}"));
    let line = |row: &InTimeRow| {
        let cell = |name: &&str| {
            let same = board.objects.iter();
            let same = same.filter(|object| object.object == *name && key(&object.row) == key(row));
            let text = same.map(|object| {
                let s = &object.row.scores;
                let ci = s.iou_in_time_ci;
                let ci = ci.map_or_else(|| "–".to_owned(), |[low, high]| format!("{low:.2}–{high:.2}"));
                format!("{} / {} ({ci})", number(s.iou_alone), number(s.iou_in_time))
            });
            text.collect::<String>()
        };
        let head = [
            short_label(&row.decoder).to_owned(),
            learned(row),
            row.m.to_string(),
            moment(row.since_touch_s),
        ];
        head.into_iter().chain(names.iter().map(cell)).collect()
    };
    let presses = board.rows.iter().filter(|row| row.contact == ContactKind::Press);
    let head = ["decoder", "learned", "M", "time"].into_iter();
    let table = TextTable {
        head: head.chain(names.iter().copied()).map(str::to_owned).collect(),
        rows: presses.map(line).collect(),
    };
    format!("\nobject by object: alone / in time (95 %)\n{table}")
}
