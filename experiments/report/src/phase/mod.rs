//! Files and figures of `spts phase`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::{save_charts, save_sheet};
use spts::output::{OutputFolder, write_json, write_table};
use spts_studies::phase::PhaseReport;

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["rates.csv", "crossings.csv", "phase.json"];

/// Writes `rates.csv`, `crossings.csv`, `phase.json` and the figures into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(report: &PhaseReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path("rates.csv"), &report.rates)?;
        write_table(&out.path("crossings.csv"), &report.crossings)?;
        write_json(&out.path("phase.json"), report)?;
        let figures = out.folder("figures")?;
        save_charts(&picture::charts(report), &figures, "phase")?;
        save_sheet(&picture::sheet(report), &figures, "phase_rates")?;
        Ok(())
    })
}
