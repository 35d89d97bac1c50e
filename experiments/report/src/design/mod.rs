//! Files and figures of `spts design`.

mod folder;
mod picture;

pub use folder::{DesignFolderError, read_design};

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_studies::design::DesignReport;

/// Files of `spts design` outside of folders of their own.
pub const FILES: &[&str] = &["design.json", "profile.toml", "scene.toml", "rows.txt", "curves.csv"];

/// A point of a curve.
#[derive(Debug, serde::Serialize)]
struct CurveLine<'a> {
    wires: usize,
    rows: &'a str,
    m_per_wire: usize,
    acquisition_s: f64,
    iou: f64,
    iou_low: f64,
    iou_high: f64,
    place_px: f64,
}

/// Writes the design, the profile and the scene that simulate it, its pattern where it has one, what was tried and a
/// picture of it into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(report: &DesignReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_json(&out.path("design.json"), report)?;
        write_bytes(&out.path("profile.toml"), report.profile.as_bytes())?;
        write_bytes(&out.path("scene.toml"), report.scene.as_bytes())?;
        if let Some(pattern) = &report.pattern {
            write_bytes(&out.path("rows.txt"), pattern.as_bytes())?;
        }
        let period_s = report.design.wire.period_s;
        let lines = report.curves.iter().flat_map(|curve| {
            curve.points.iter().map(move |p| CurveLine {
                wires: curve.wires,
                rows: curve.rows.name(),
                m_per_wire: p.m_per_wire,
                acquisition_s: p.m_per_wire as f64 * period_s,
                iou: p.iou.mean,
                iou_low: p.iou.low,
                iou_high: p.iou.high,
                place_px: p.place_px,
            })
        });
        write_table(&out.path("curves.csv"), &lines.collect::<Vec<_>>())?;
        save_charts(&picture::charts(report), &out.folder("figures")?, "design")?;
        Ok(())
    })
}
