//! The board of an earlier run.

use super::super::context::note;
use super::super::error::CliError;
use spts::output::{OutputError, check_writable};
use spts_eval::board::{Regression, ScoreBoard};
use std::path::Path;

/// Says which scores fell.
///
/// # Errors
/// [`CliError::Differs`] when one did.
pub(super) fn verdict(found: &[Regression]) -> Result<(), CliError> {
    if found.is_empty() {
        return Ok(());
    }
    for r in found {
        let now = r.now.map_or_else(|| "gone".to_owned(), |v| format!("{v:.4}"));
        note(&format!("{}: {} was {:.4}, is {now}", r.what, r.score, r.before));
    }
    let gone = found.iter().filter(|r| r.now.is_none()).count();
    let fell = found.len() - gone;
    Err(CliError::Differs(format!("{fell} scores fell, {gone} are gone")))
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
        CliError::Usage(format!("{}: not a board as --save writes it: {e}", path.display()))
    };
    let text = spts_input::read_text(path, MAX_BOARD_BYTES).map_err(|e| usage(&e))?;
    serde_json::from_str(&text).map_err(|e| usage(&e))
}
