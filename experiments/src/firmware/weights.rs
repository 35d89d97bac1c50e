//! The weights that emulated cells put out, as an array.

use super::plan::Plan;
use crate::cli::CliError;
use crate::output::write_npy_with;
use spts_circuit::WeightMode;
use std::io;
use std::path::Path;

/// Edges that are clocked at a time: a few megabytes of levels.
const CHUNK: usize = 4096;

/// Writes the levels of every cell of `plan` in `mode` to the NumPy file `path`, shape (edges, cells), as doubles: row r holds the
/// weights of measurement r. `tick` is called with the number of edges done.
///
/// # Errors
/// [`CliError`] when a cell does not answer or the file cannot be written.
pub fn write_weights(plan: &Plan, mode: WeightMode, path: &Path, tick: &dyn Fn(u64)) -> Result<(), CliError> {
    let edges = usize::try_from(plan.edges).map_err(|e| CliError::Usage(format!("`--edges`: {e}")))?;
    let mut array = plan.started(mode)?;
    write_npy_with(path, &[edges, plan.cells], |push| {
        let (mut codes, mut levels, mut left) = (Vec::new(), Vec::new(), edges);
        while left > 0 {
            let rows = left.min(CHUNK);
            codes.resize(rows * plan.cells, 0);
            array.clock(plan.clock, &mut codes).map_err(io::Error::other)?;
            levels.clear();
            levels.extend(codes.iter().map(|code| mode.code_level(*code)));
            push(&levels)?;
            left -= rows;
            tick(rows as u64);
        }
        Ok(())
    })?;
    Ok(())
}
