//! Files and figures of `spts sensing study`.

use crate::figures::{Chart, Series, Style, save_charts};
use crate::{ReportError, write_all_or_none};
use serde::Serialize;
use spts::output::{OutputFolder, write_json, write_table};
use spts_recon::rows::designer;
use spts_studies::sensing::{CostRow, SensingReport, SensingRow};

/// Files of `spts sensing study` outside of folders of their own.
pub const STUDY_FILES: &[&str] = &["study.csv", "study.json", "equal.csv", "costs.csv", "objects.csv"];

/// Inks of the designers in a panel; random rows are the first.
const INKS: [(Style, u8); 8] = [
    (Style::Real, 0),
    (Style::Twin, 0),
    (Style::Raster, 0),
    (Style::Baseline, 0),
    (Style::Twin, 1),
    (Style::RasterReal, 0),
    (Style::Raster, 1),
    (Style::Baseline, 2),
];

/// A line of `study.csv`.
#[derive(Debug, Serialize)]
struct ScoreLine<'a> {
    touches: &'a str,
    readout: &'a str,
    designer: &'a str,
    m: usize,
    iou: f64,
    iou_low: f64,
    iou_high: f64,
    gain: f64,
    gain_low: f64,
    gain_high: f64,
    place_px: Option<f64>,
    clipped: f64,
}

/// A line of `costs.csv`.
#[derive(Debug, Serialize)]
struct CostLine<'a> {
    designer: &'a str,
    order: &'a str,
    m: usize,
    flips: f64,
    rms_v: f64,
    peak_v: f64,
    headroom: Option<f64>,
    cause: &'a str,
    error_share: f64,
}

/// Writes tables and the figure into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_study(report: &SensingReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(
            &out.path("study.csv"),
            &report.rows.iter().map(score_line).collect::<Vec<_>>(),
        )?;
        write_json(&out.path("study.json"), report)?;
        write_table(&out.path("equal.csv"), &report.equal)?;
        write_table(
            &out.path("costs.csv"),
            &report.costs.iter().flat_map(cost_lines).collect::<Vec<_>>(),
        )?;
        write_table(&out.path("objects.csv"), &report.named)?;
        save_charts(&charts(report), &out.folder("figures")?, "sensing")?;
        Ok(())
    })
}

fn score_line(row: &SensingRow) -> ScoreLine<'_> {
    ScoreLine {
        touches: row.touches,
        readout: &row.readout,
        designer: row.designer,
        m: row.m,
        iou: row.iou.mean,
        iou_low: row.iou.low,
        iou_high: row.iou.high,
        gain: row.gain.mean,
        gain_low: row.gain.low,
        gain_high: row.gain.high,
        place_px: row.place_px.map(|place| place.mean),
        clipped: row.clipped,
    }
}

fn cost_lines(row: &CostRow) -> impl Iterator<Item = CostLine<'_>> {
    row.errors.iter().map(|error| CostLine {
        designer: row.designer,
        order: row.order,
        m: row.m,
        flips: row.flips,
        rms_v: row.rms_v,
        peak_v: row.peak_v,
        headroom: row.headroom(),
        cause: error.cause,
        error_share: error.share,
    })
}

/// IoU over M, a panel for each kind of touches and readout, a curve with its band for each designer.
fn charts(report: &SensingReport) -> Vec<Chart> {
    let mut panels: Vec<(&str, &str)> = Vec::new();
    let mut designers: Vec<&str> = Vec::new();
    for row in &report.rows {
        if !panels.contains(&(row.touches, &row.readout)) {
            panels.push((row.touches, &row.readout));
        }
        if !designers.contains(&row.designer) {
            designers.push(row.designer);
        }
    }
    let chart = |(touches, readout): &(&str, &str)| {
        let series = designers
            .iter()
            .zip(INKS.iter().cycle())
            .map(|(name, (style, variant))| {
                let rows = report.rows.iter();
                let own = rows.filter(|r| r.designer == *name && r.touches == *touches && r.readout == *readout);
                let own: Vec<&SensingRow> = own.collect();
                let points = own.iter().map(|r| (r.m as f64, r.iou.mean)).collect();
                let label = designer(name).map_or(*name, |d| d.label);
                let curve = Series::new(label, *style, *variant, points);
                curve.with_band(own.iter().map(|r| (r.m as f64, r.iou.low, r.iou.high)).collect())
            });
        let what = match *touches {
            "shapes" => "Shapes never seen",
            _ => "Objects never seen, moved and turned",
        };
        Chart {
            title: format!("{what}, {readout}"),
            x_label: "measurements M".to_owned(),
            y_label: "IoU".to_owned(),
            series: series.collect(),
            ..Chart::default()
        }
    };
    panels.iter().map(chart).collect()
}
