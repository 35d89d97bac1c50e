//! The files of a budget.

mod figures;

use super::{ReportError, write_all_or_none};
use crate::figures::save_bars;
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_studies::budget::{BudgetReport, BudgetRow, Change};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["budget.csv", "end_points.csv", "summary.md", "provenance.json"];

/// Writes the tables, their summary, the figures and the provenance of `report` into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &BudgetReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path("budget.csv"), &report.rows)?;
        write_table(&out.path("end_points.csv"), &report.end_points)?;
        write_bytes(&out.path("summary.md"), report.markdown().as_bytes())?;
        let folder = out.folder("figures")?;
        for decode in report.decodes() {
            for (name, truth, iou) in [
                ("budget", "truth from the raster scan", BudgetRow::iou as Change),
                ("contact", "truth from the contact alone", BudgetRow::iou_contact),
            ] {
                let chart = figures::bars(report, decode, truth, iou);
                save_bars(&chart, &folder, &format!("{name}_{decode}"))?;
            }
        }
        write_json(&out.path("provenance.json"), &report.provenance)?;
        Ok(())
    })
}
