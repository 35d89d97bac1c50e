//! The files of a comparison of the twin with recordings.

mod figures;

use super::{ReportError, per_object, write_all_or_none};
use crate::figures::FigureError;
use spts::output::{OutputFolder, write_json, write_table};
use spts_studies::arm::ArmReport;
use spts_studies::compare::CompareReport;
use spts_studies::per_object::PerObjectReport;
use std::path::Path;

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "compare.csv",
    "curves.csv",
    "predicted.csv",
    per_object::TABLES[0],
    per_object::TABLES[1],
    per_object::TABLES[2],
    ARM[0],
    ARM[1],
];

/// Tables of the bent skin.
const ARM: [&str; 2] = ["arm.csv", "arm.json"];

/// Writes the tables of the bent skin into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_arm(report: &ArmReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path(ARM[0]), &report.statistics)?;
        write_json(&out.path(ARM[1]), report)?;
        Ok(())
    })
}

/// Writes the tables and the figures of `report`, and of `objects` where there are any, into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &CompareReport, objects: Option<&PerObjectReport>, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        if !report.predicted.is_empty() {
            write_table(&out.path("predicted.csv"), &report.predicted)?;
            return Ok(());
        }
        write_table(&out.path("compare.csv"), &report.all_statistics())?;
        write_table(&out.path("curves.csv"), report.distances())?;
        let figures = out.folder("figures")?;
        draw(report, &figures)?;
        if let Some(objects) = objects {
            per_object::write_tables(objects, |name| out.path(name))?;
            per_object::draw(objects, &figures)?;
        }
        Ok(())
    })
}

/// Draws the figures of `report`, each as .svg and .png, into `folder`: `residuals`, `quantiles` and, with curves,
/// `scores`.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found.
pub fn draw(report: &CompareReport, folder: &Path) -> Result<(), FigureError> {
    figures::draw(&report.compared, report.curves.as_ref(), folder)
}
