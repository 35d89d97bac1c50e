//! Files and figures of `spts readouts`.

mod lines;
mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use lines::lines;
use spts::output::{OutputError, OutputFolder, write_bytes, write_json, write_table};
use spts::provenance::{Provenance, hash_text};
use spts_studies::readouts::{ReadoutsReport, ReadoutsStudy};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "readouts.csv",
    "readouts.json",
    "readouts.md",
    "published.csv",
    "parameters.json",
    "provenance.json",
];

/// Writes the tables, the figure and what they depend on into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(study: &ReadoutsStudy, report: &ReadoutsReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        let path = out.path("parameters.json");
        let parameters = study.parameters();
        let text = serde_json::to_string(&parameters).map_err(|e| OutputError::Write {
            path: path.clone(),
            source: e.into(),
        })?;
        write_json(&path, &parameters)?;
        let provenance = Provenance::new(study.seed, hash_text(text.as_bytes()));
        write_json(&out.path("provenance.json"), &provenance)?;
        write_table(&out.path("readouts.csv"), &lines(report))?;
        write_table(&out.path("published.csv"), report.published)?;
        write_json(&out.path("readouts.json"), report)?;
        write_bytes(&out.path("readouts.md"), report.text().as_bytes())?;
        save_charts(&picture::charts(report), &out.folder("figures")?, "readouts")?;
        Ok(())
    })
}
