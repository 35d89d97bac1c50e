//! Results as files.

use super::rows::{InTimeBoard, InTimeRow};
use serde::Serialize;
use spts::output::{OutputError, OutputFolder, write_csv, write_json};

/// Names of the result files.
pub const FILES: &[&str] = &["in_time.json", "in_time.csv", "objects.csv"];

const COLUMNS: [&str; 25] = [
    "decoder",
    "left_out",
    "learned_from",
    "contact",
    "m",
    "since_touch_s",
    "iou_alone",
    "iou_longer",
    "iou_in_time",
    "iou_gain",
    "error_alone_px",
    "error_longer_px",
    "error_in_time_px",
    "error_gain_px",
    "iou_alone_low",
    "iou_alone_high",
    "iou_in_time_low",
    "iou_in_time_high",
    "iou_gain_low",
    "iou_gain_high",
    "error_gain_low",
    "error_gain_high",
    "contacts",
    "memory_s",
    "strength_memory_s",
];

/// Writes `in_time.json`, `in_time.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(board: &InTimeBoard, out: &mut OutputFolder) -> Result<(), OutputError> {
    write_json(&out.path("in_time.json"), board)?;
    write_csv(&out.path("in_time.csv"), &COLUMNS, board.rows.iter().map(line))?;
    write_csv(
        &out.path("objects.csv"),
        &[&["object"][..], &COLUMNS].concat(),
        board.objects.iter().map(|object| (&object.object, line(&object.row))),
    )
}

fn line(row: &InTimeRow) -> impl Serialize + use<'_> {
    let s = &row.scores;
    let ci = [s.iou_alone_ci, s.iou_in_time_ci, s.iou_gain_ci, s.error_gain_ci];
    (
        (
            &row.decoder,
            row.left_out,
            &row.learned_from,
            row.contact.name(),
            row.m,
            row.since_touch_s,
        ),
        [s.iou_alone, s.iou_longer, s.iou_in_time, s.iou_gain],
        [s.error_alone_px, s.error_longer_px, s.error_in_time_px, s.error_gain_px],
        ci.map(|ci| ci.map_or([None; 2], |ci| ci.map(Some))),
        row.contacts,
        (super::MEMORY_S, super::STRENGTH_MEMORY_S),
    )
}
