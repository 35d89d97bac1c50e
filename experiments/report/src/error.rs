//! Why a report could not be written.

use crate::figures::FigureError;
use spts::output::{OutputError, OutputFolder, Staged};
use std::path::Path;

/// A report that could not be written. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A table or an array cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
}

impl ReportError {
    /// The same error with the final place of a result in `staged` instead of the place where the result waited.
    #[must_use]
    pub fn unstaged(self, staged: &Staged) -> Self {
        match self {
            Self::Output(error) => Self::Output(staged.unstaged(error)),
            Self::Figure(error) => Self::Figure(error.relocated(&|path| staged.final_path(path))),
        }
    }
}

/// Writes what `write` makes into the folder `out`: all files or, after an error, none.
///
/// # Errors
/// [`ReportError`] of `write`, or when the folder cannot be made. Paths in the message are those below `out`.
pub fn write_all_or_none(
    out: &Path,
    write: impl FnOnce(&Staged) -> Result<(), ReportError>,
) -> Result<(), ReportError> {
    let staged = OutputFolder::create(out)?.stage()?;
    write(&staged).map_err(|error| error.unstaged(&staged))?;
    staged.commit()?;
    Ok(())
}
