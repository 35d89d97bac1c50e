//! Files and figures of `spts score`.

mod anytime;
mod in_time;
mod picture;

use super::{ReportError, write_all_or_none};
use spts::output::OutputFolder;
use spts_eval::anytime::{self as stops, AnytimeBoard};
use spts_eval::board::{self, ScoreBoard};
use spts_eval::in_time::{self as followed, InTimeBoard};

/// Files outside of folders of their own.
pub use spts_eval::board::FILES;

/// Writes `board.json`, `board.csv`, `objects.csv`, `localisation.csv` and the figures into the folder `out`: all of
/// them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(scores: &ScoreBoard, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        board::write(scores, out)?;
        picture::draw(scores, &out.folder("figures")?)?;
        Ok(())
    })
}

/// Writes `anytime.json`, `anytime.csv`, `objects.csv` and the figure `anytime` into the folder `out`: all of them, or
/// none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_anytime(scores: &AnytimeBoard, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        stops::write(scores, out)?;
        anytime::draw(scores, &out.folder("figures")?)?;
        Ok(())
    })
}

/// Writes `in_time.json`, `in_time.csv`, `objects.csv` and the figure `in_time` into the folder `out`: all of them, or
/// none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_in_time(scores: &InTimeBoard, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        followed::write(scores, out)?;
        in_time::draw(scores, &out.folder("figures")?)?;
        Ok(())
    })
}
