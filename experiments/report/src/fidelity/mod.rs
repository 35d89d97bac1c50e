//! The files of a fidelity study.

mod figures;

use super::{Origin, ReportError, write_all_or_none};
use crate::figures::{save_charts, save_sheet};
use serde::Serialize;
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_sim::fidelity::MeasuredSetting;
use spts_studies::fidelity::FidelityReport;

/// A line without what depends on the machine.
#[derive(Debug, Serialize)]
struct ErrorRow<'a> {
    scene: &'a str,
    #[serde(rename = "rung")]
    level: &'a str,
    cells: &'a str,
    timestep_s: f64,
    pressure_rms_rel: f64,
    taxel_rms_rel: f64,
    support_delta: f64,
    iou_delta: f64,
    class_delta: f64,
}

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "errors.csv",
    "fidelity.csv",
    "refused.csv",
    "summary.md",
    "provenance.json",
];

/// Writes the tables, their summary, the figures and the provenance of `report` beside the scenes that wait in `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &FidelityReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        let errors: Vec<ErrorRow<'_>> = report.rows.iter().map(ErrorRow::from).collect();
        write_table(&out.path("errors.csv"), &errors)?;
        write_table(&out.path("fidelity.csv"), &report.rows)?;
        write_table(&out.path("refused.csv"), &report.refusals)?;
        write_bytes(&out.path("summary.md"), report.text().as_bytes())?;
        let folder = out.folder("figures")?;
        save_charts(&figures::pareto(&report.rows), &folder, "pareto")?;
        save_sheet(&figures::pressures(&report.rows, &report.fine), &folder, "pressure")?;
        write_json(&out.path("provenance.json"), &Origin::here(report.provenance.clone()))?;
        Ok(())
    })
}

impl<'a> From<&'a MeasuredSetting> for ErrorRow<'a> {
    fn from(row: &'a MeasuredSetting) -> Self {
        Self {
            scene: &row.scene,
            level: &row.level,
            cells: &row.cells,
            timestep_s: row.timestep_s,
            pressure_rms_rel: row.pressure_rms_rel,
            taxel_rms_rel: row.taxel_rms_rel,
            support_delta: row.support_delta,
            iou_delta: row.iou_delta,
            class_delta: row.class_delta,
        }
    }
}
