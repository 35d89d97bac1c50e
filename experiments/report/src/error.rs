//! Results that are written whole or not at all.

use spts::output::{OutputError, OutputFolder};

/// A report that could not be written. The message names the file.
pub type ReportError = OutputError;

/// Writes what `write` makes into the folder `out`: all files or, after an error, none.
///
/// # Errors
/// [`ReportError`] of `write`, or when the results cannot be put in place.
pub fn write_all_or_none(
    mut out: OutputFolder,
    write: impl FnOnce(&mut OutputFolder) -> Result<(), ReportError>,
) -> Result<(), ReportError> {
    write(&mut out).map_err(|error| out.unstaged(error))?;
    out.commit()?;
    Ok(())
}
