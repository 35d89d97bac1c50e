//! The board of an earlier run.

use super::super::context::note;
use super::super::error::CliError;
use spts::output::{OutputError, check_writable};
use spts_eval::board::{Difference, Regression, ScoreBoard};
use std::path::Path;

/// Says what this board and the earlier one, which is in `file`, do not have in common.
pub(super) fn note_differences(file: &Path, found: &[Difference]) {
    let file = file.display();
    for Difference {
        what,
        only_before,
        only_now,
    } in found
    {
        let sides = [
            (format!("only in {file}"), only_before),
            ("only in this run".to_owned(), only_now),
        ];
        let sides = sides.iter().filter(|(_, names)| !names.is_empty());
        let sides: Vec<String> = sides
            .map(|(side, names)| format!("{side}: {}", names.join(", ")))
            .collect();
        let means = if *what == "objects" {
            "; the means are over different objects"
        } else {
            ""
        };
        note(&format!("note: {what} {}{means}", sides.join("; ")));
    }
}

/// Says which scores fell, and which rows of the earlier board this one lacks.
///
/// # Errors
/// [`CliError::Differs`] when there are any.
pub(super) fn verdict(found: &[Regression]) -> Result<(), CliError> {
    if found.is_empty() {
        return Ok(());
    }
    for r in found {
        if let Some(now) = r.now {
            note(&format!("{}: {} was {:.4}, is {now:.4}", r.what, r.score, r.before));
        }
    }
    let gone: Vec<&Regression> = found.iter().filter(|r| r.now.is_none()).collect();
    for row in gone.chunk_by(|a, b| a.what == b.what) {
        let scores: Vec<&str> = row.iter().map(|r| r.score).collect();
        note(&format!(
            "{}: not scored in this run: {}",
            row[0].what,
            scores.join(", ")
        ));
    }
    let fell = found.len() - gone.len();
    Err(CliError::Differs(format!(
        "{fell} scores fell, {} are gone",
        gone.len()
    )))
}

/// Refuses to save a board where one cannot be written, and in place of a file that is no board.
pub(super) fn check_board(path: &Path) -> Result<(), CliError> {
    check_writable(path)?;
    if path.exists() && read_board(path).is_err() {
        return Err(OutputError::NotOurs { path: path.to_owned() }.into());
    }
    Ok(())
}

/// Largest board that is read, bytes: one of all decoders, sources and objects has less than 1 MB.
const MAX_BOARD_BYTES: u64 = 1 << 25;

/// The board in a file that `--save` wrote.
pub(super) fn read_board(path: &Path) -> Result<ScoreBoard, CliError> {
    let usage = |e: &dyn std::fmt::Display| {
        CliError::usage(format!("{}: not a board as --save writes it: {e}", path.display()))
    };
    let text = spts_input::read_text(path, MAX_BOARD_BYTES).map_err(|e| usage(&e))?;
    serde_json::from_str(&text).map_err(|e| usage(&e))
}
