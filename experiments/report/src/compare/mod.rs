//! The files of a comparison of the twin with recordings.

mod figures;

use super::{ReportError, write_all_or_none};
use crate::figures::FigureError;
use spts::output::write_table;
use spts_studies::compare::CompareReport;
use std::path::Path;

/// Writes the tables and the figures of `report` into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &CompareReport, out: &Path) -> Result<(), ReportError> {
    write_all_or_none(out, |staged| {
        write_table(&staged.path("compare.csv"), &report.all_statistics())?;
        write_table(&staged.path("curves.csv"), report.distances())?;
        draw(report, &staged.folder("figures")?)?;
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
