//! The weights that emulated cells put out, as an array.

use super::plan::Plan;
use crate::cli::CliError;
use crate::output::write_npy_from;
use spts_circuit::WeightMode;
use std::path::Path;

/// Writes the levels of every cell of `plan` in `mode` to the NumPy file `path`, shape (edges, cells), as doubles: row r holds the
/// weights of measurement r.
///
/// # Errors
/// [`CliError`] when a cell does not answer or the file cannot be written.
pub fn write_weights(plan: &Plan, mode: WeightMode, path: &Path) -> Result<(), CliError> {
    let edges = usize::try_from(plan.edges).map_err(|e| CliError::Usage(format!("`--edges`: {e}")))?;
    let mut codes = vec![0; edges * plan.cells];
    plan.started(mode)?
        .clock(plan.clock, &mut codes)
        .map_err(|e| plan.unusable(&e))?;
    let levels = codes.into_iter().map(|code| mode.code_level(code));
    write_npy_from(path, &[edges, plan.cells], levels)?;
    Ok(())
}
