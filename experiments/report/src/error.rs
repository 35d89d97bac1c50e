//! Why a report could not be written.

use crate::figures::FigureError;
use spts::output::{OutputError, OutputFolder};

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
    /// The same error with the final place of a result of `out` instead of the place where the result waited.
    #[must_use]
    pub fn unstaged(self, out: &OutputFolder) -> Self {
        match self {
            Self::Output(error) => Self::Output(out.unstaged(error)),
            Self::Figure(error) => Self::Figure(error.relocated(&|path| out.final_path(path))),
        }
    }
}

/// Writes what `write` makes into the folder `out`: all files or, after an error, none.
///
/// # Errors
/// [`ReportError`] of `write`, or when the results cannot be put in place.
pub fn write_all_or_none(
    mut out: OutputFolder,
    write: impl FnOnce(&mut OutputFolder) -> Result<(), ReportError>,
) -> Result<(), ReportError> {
    write(&mut out).map_err(|error| error.unstaged(&out))?;
    out.commit()?;
    Ok(())
}
