//! Results that are written whole or not at all.

use spts::output::{OutputError, OutputFolder};

/// Writes what `write` makes into the folder `out`: all files or, after an error, none.
///
/// # Errors
/// [`OutputError`] of `write`, or when the results cannot be put in place.
pub fn write_all_or_none(
    mut out: OutputFolder,
    write: impl FnOnce(&mut OutputFolder) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    write(&mut out).map_err(|error| out.unstaged(error))?;
    out.commit()?;
    Ok(())
}
