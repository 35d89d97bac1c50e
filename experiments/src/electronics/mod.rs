//! `spts circuit`: what the summing amplifier makes of a skin of any size, in closed form, and what larger ones take.

mod designed;
mod picture;
mod table;

pub use table::{Study, TABLE_TAXELS, text};

use crate::cli::CliError;
use crate::figures::save_charts;
use crate::output::{OutputFolder, write_json, write_table};
use std::path::Path;

impl Study {
    /// Writes `circuit.csv`, `parameters.json` and `figures/circuit` into the folder `out`: all of them, or none.
    ///
    /// # Errors
    /// [`CliError`] when a number is outside its range or a file cannot be written.
    pub fn write(&self, out: &Path) -> Result<(), CliError> {
        OutputFolder::check(out)?;
        let rows = self.sweep()?;
        let staged = OutputFolder::create(out)?.stage()?;
        let write = || -> Result<(), CliError> {
            write_table(&staged.path("circuit.csv"), &table::lines(&rows))?;
            write_json(&staged.path("parameters.json"), self)?;
            save_charts(&picture::charts(&rows, self), &staged.folder("figures")?, "circuit")?;
            Ok(())
        };
        write().map_err(|error| error.unstaged(&staged))?;
        staged.commit()?;
        Ok(())
    }
}
