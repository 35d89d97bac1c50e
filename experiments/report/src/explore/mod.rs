//! Files and figures of `spts explore`.

mod lines;
mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use lines::{fit_lines, size_lines, timing_lines, trial_lines};
use spts::output::{OutputError, write_json, write_table};
use spts::provenance::{Machine, Provenance, hash_text};
use spts_studies::explore::{ExploreReport, ExploreStudy};
use std::path::Path;

/// Writes the tables, the figures and what they depend on into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(study: &ExploreStudy, report: &ExploreReport, out: &Path) -> Result<(), ReportError> {
    write_all_or_none(out, |staged| {
        let path = staged.path("parameters.json");
        let parameters = serde_json::to_string(study).map_err(|e| OutputError::Write {
            path: path.clone(),
            source: e.into(),
        })?;
        let provenance = Provenance::new(study.seed, hash_text(parameters.as_bytes()));
        write_table(&staged.path("explore.csv"), &size_lines(report))?;
        write_table(&staged.path("trials.csv"), &trial_lines(report))?;
        write_table(&staged.path("fits.csv"), &fit_lines(report, false))?;
        write_table(&staged.path("timings.csv"), &timing_lines(report))?;
        write_json(&staged.path("timing.json"), &(Machine::here(), fit_lines(report, true)))?;
        write_json(&path, study)?;
        write_json(&staged.path("provenance.json"), &provenance)?;
        let figures = staged.folder("figures")?;
        save_charts(&picture::charts(report), &figures, "explore")?;
        save_charts(&[picture::timing(report)], &figures, "timing")?;
        Ok(())
    })
}
