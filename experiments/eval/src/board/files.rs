//! A board as files.

use super::ScoreBoard;
use crate::Scores;
use spts::output::{OutputError, OutputFolder, write_csv, write_json, write_table};

/// Columns that both tables have.
const SCORES: [&str; 6] = ["support", "iou", "f1", "class_single", "class_vote20", "class_evidence"];

/// Names of the result files.
pub const FILES: &[&str] = &["board.json", "board.csv", "objects.csv", "localisation.csv"];

/// Writes `board.json`, `board.csv`, `objects.csv` and `localisation.csv` into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(board: &ScoreBoard, out: &mut OutputFolder) -> Result<(), OutputError> {
    write_json(&out.path("board.json"), board)?;
    let times = ["decode_us", "acquire_us", "too_slow", "failed"];
    let intervals = [
        "support_low",
        "support_high",
        "iou_low",
        "iou_high",
        "class_single_low",
        "class_single_high",
    ];
    let key = ["decoder", "m", "left_out", "learned_from", "sensing"];
    write_csv(
        &out.path("board.csv"),
        &[&key[..], &SCORES, &intervals, &times].concat(),
        board.rows.iter().map(|r| {
            (
                (&r.decoder, r.m, r.left_out, &r.learned_from, r.sensing),
                columns(&r.scores),
                [r.support_ci, r.iou_ci, r.class_single_ci].map(|ci| ci.map_or([None; 2], |c| c.map(Some))),
                (r.decode_us, r.acquire_us, r.too_slow, r.failed),
            )
        }),
    )?;
    write_csv(
        &out.path("objects.csv"),
        &[&key[..], &["object"], &SCORES, &intervals[2..]].concat(),
        board.objects.iter().map(|r| {
            (
                (&r.decoder, r.m, r.left_out, &r.learned_from, r.sensing, &r.object),
                columns(&r.scores),
                [r.iou_ci, r.class_single_ci].map(|ci| ci.map_or([None; 2], |c| c.map(Some))),
            )
        }),
    )?;
    if !board.localisation.is_empty() {
        write_table(&out.path("localisation.csv"), &board.localisation)?;
    }
    Ok(())
}

fn columns(s: &Scores) -> [Option<f64>; 6] {
    [s.support, s.iou, s.f1, s.class_single, s.class_vote20, s.class_evidence]
}
