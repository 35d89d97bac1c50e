//! Results as files.

use super::rows::AnytimeBoard;
use super::tally::StopScores;
use spts::output::{OutputError, OutputFolder, write_csv, write_json};

/// Names of the result files.
pub const FILES: &[&str] = &["anytime.json", "anytime.csv", "objects.csv"];

/// Columns that both tables begin with.
const KEY: [&str; 6] = [
    "decoder",
    "subject",
    "sensing",
    "left_out",
    "learned_from",
    "confidence",
];
/// Columns of the scores.
const SCORES: [&str; 7] = [
    "samples",
    "samples_median",
    "samples_p90",
    "attained",
    "attained_reached",
    "stated",
    "never",
];

/// Writes `anytime.json`, `anytime.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(board: &AnytimeBoard, out: &mut OutputFolder) -> Result<(), OutputError> {
    write_json(&out.path("anytime.json"), board)?;
    let more = [
        "samples_low",
        "samples_high",
        "attained_low",
        "attained_high",
        "most",
        "windows",
        "failed",
    ];
    write_csv(
        &out.path("anytime.csv"),
        &[&KEY[..], &SCORES, &more].concat(),
        board.rows.iter().map(|r| {
            (
                (
                    &r.decoder,
                    r.subject,
                    r.sensing,
                    r.left_out,
                    &r.learned_from,
                    r.confidence,
                ),
                columns(&r.scores),
                [r.samples_ci, r.attained_ci].map(|ci| ci.map_or([None; 2], |c| c.map(Some))),
                (r.most, r.windows, r.failed),
            )
        }),
    )?;
    write_csv(
        &out.path("objects.csv"),
        &[&KEY[..], &["object"], &SCORES, &["windows"]].concat(),
        board.objects.iter().map(|r| {
            (
                (
                    &r.decoder,
                    r.subject,
                    r.sensing,
                    r.left_out,
                    &r.learned_from,
                    r.confidence,
                ),
                &r.object,
                columns(&r.scores),
                r.windows,
            )
        }),
    )
}

fn columns(s: &StopScores) -> [Option<f64>; 7] {
    [
        s.samples,
        s.samples_median,
        s.samples_p90,
        s.attained,
        s.attained_reached,
        s.stated,
        s.never,
    ]
}
