//! Files and figures of `spts phase`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::{save_charts, save_sheet};
use spts::output::{write_json, write_table};
use spts_studies::phase::PhaseReport;
use std::path::Path;

/// Writes `rates.csv`, `crossings.csv`, `phase.json` and the figures into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(report: &PhaseReport, out: &Path) -> Result<(), ReportError> {
    write_all_or_none(out, |staged| {
        write_table(&staged.path("rates.csv"), &report.rates)?;
        write_table(&staged.path("crossings.csv"), &report.crossings)?;
        write_json(&staged.path("phase.json"), report)?;
        let figures = staged.folder("figures")?;
        save_charts(&picture::charts(report), &figures, "phase")?;
        save_sheet(&picture::sheet(report), &figures, "phase_rates")?;
        Ok(())
    })
}
