//! Files and figures of `spts explore`.

mod lines;
mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use lines::{fit_lines, size_lines, timing_lines, trial_lines};
use spts::output::{OutputError, OutputFolder, write_json, write_table};
use spts::provenance::{Machine, Provenance, hash_text};
use spts_studies::explore::{ExploreReport, ExploreStudy};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "explore.csv",
    "trials.csv",
    "fits.csv",
    "timings.csv",
    "timing.json",
    "parameters.json",
    "provenance.json",
];

/// Writes the tables, the figures and what they depend on into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(study: &ExploreStudy, report: &ExploreReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        let path = out.path("parameters.json");
        let parameters = serde_json::to_string(study).map_err(|e| OutputError::Write {
            path: path.clone(),
            source: e.into(),
        })?;
        let provenance = Provenance::new(study.seed, hash_text(parameters.as_bytes()));
        write_table(&out.path("explore.csv"), &size_lines(report))?;
        write_table(&out.path("trials.csv"), &trial_lines(report))?;
        write_table(&out.path("fits.csv"), &fit_lines(report, false))?;
        write_table(&out.timed_path("timings.csv"), &timing_lines(report))?;
        write_json(
            &out.timed_path("timing.json"),
            &(Machine::here(), fit_lines(report, true)),
        )?;
        write_json(&path, study)?;
        write_json(&out.path("provenance.json"), &provenance)?;
        let figures = out.folder("figures")?;
        save_charts(&picture::charts(report), &figures, "explore")?;
        save_charts(&[picture::timing(report)], &figures, "timing")?;
        Ok(())
    })
}
