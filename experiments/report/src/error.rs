//! Results that are written whole or not at all.

use serde::Serialize;
use spts::output::{OutputFolder, unwritable, write_json};
use spts::provenance::{Provenance, hash_text};
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

/// Writes the settings of a study as `parameters.json`, and `provenance.json` with their hash.
pub(crate) fn write_parameters(out: &OutputFolder, parameters: &impl Serialize, seed: u64) -> Result<(), Refusal> {
    let path = out.path("parameters.json");
    let text = serde_json::to_string(parameters).map_err(unwritable(&path))?;
    write_json(&path, parameters)?;
    let provenance = Provenance::new(seed, hash_text(text.as_bytes()));
    write_json(&out.path("provenance.json"), &provenance)
}
