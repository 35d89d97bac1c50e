//! Results that are written whole or not at all.

use spts::output::OutputFolder;
use spts_input::Refusal;

/// Writes what `write` makes into the folder `out`: all files or, after an error, none.
///
/// # Errors
/// [`Refusal`] of `write`, or when the results cannot be put in place.
pub fn write_all_or_none(
    mut out: OutputFolder,
    write: impl FnOnce(&mut OutputFolder) -> Result<(), Refusal>,
) -> Result<(), Refusal> {
    write(&mut out).map_err(|error| out.unstaged(error))?;
    out.commit()?;
    Ok(())
}
