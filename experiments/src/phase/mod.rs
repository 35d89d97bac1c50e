//! `spts phase`: where in the plane of undersampling and sparsity each recovery algorithm works, beside the theory.

mod methods;
mod picture;
mod study;
mod text;

pub use methods::{Method, Theory, methods};
pub use study::{Crossing, Outcome, RatePoint, Study};

use crate::cli::CliError;
use crate::figures::{save_charts, save_sheet};
use crate::output::{OutputFolder, write_json, write_table};
use std::path::Path;

impl Outcome {
    /// Writes `rates.csv`, `crossings.csv`, `phase.json` and the figures into the folder `out`: all of them, or none.
    ///
    /// # Errors
    /// [`CliError`] when a file cannot be written.
    pub fn write(&self, out: &Path) -> Result<(), CliError> {
        let staged = OutputFolder::create(out)?.stage()?;
        let write = || -> Result<(), CliError> {
            write_table(&staged.path("rates.csv"), &self.rates)?;
            write_table(&staged.path("crossings.csv"), &self.crossings)?;
            write_json(&staged.path("phase.json"), self)?;
            let figures = staged.folder("figures")?;
            save_charts(&picture::charts(self), &figures, "phase")?;
            save_sheet(&picture::sheet(self), &figures, "phase_rates")?;
            Ok(())
        };
        write().map_err(|error| error.unstaged(&staged))?;
        staged.commit()?;
        Ok(())
    }
}
