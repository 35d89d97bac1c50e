//! Files and figures of `spts sensing study`.

use crate::figures::{Chart, Series, Style, save_charts};
use crate::{ReportError, write_all_or_none};
use serde::Serialize;
use spts::output::{OutputFolder, write_json, write_table};
use spts_recon::rows::DESIGNERS;
use spts_studies::sensing::{ClassRow, CostRow, SensingReport, SensingRow};
use spts_studies::touches::Band;

/// Files of `spts sensing study` outside of folders of their own.
pub const STUDY_FILES: &[&str] = &[
    "study.csv",
    "study.json",
    "equal.csv",
    "classes.csv",
    "costs.csv",
    "objects.csv",
];

/// Inks of the designers, in the order of their table.
const INKS: [(Style, u8); 9] = [
    (Style::Real, 0),
    (Style::Twin, 0),
    (Style::Raster, 0),
    (Style::Baseline, 0),
    (Style::Twin, 1),
    (Style::RasterReal, 0),
    (Style::Raster, 1),
    (Style::Baseline, 2),
    (Style::Twin, 2),
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

/// A line of `classes.csv`.
#[derive(Debug, Serialize)]
struct ClassLine<'a> {
    readout: &'a str,
    designer: &'a str,
    m: usize,
    classified: f64,
    low: f64,
    high: f64,
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
            &out.path("classes.csv"),
            &report.classes.iter().map(class_line).collect::<Vec<_>>(),
        )?;
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

fn class_line(row: &ClassRow) -> ClassLine<'_> {
    ClassLine {
        readout: &row.readout,
        designer: row.designer,
        m: row.m,
        classified: row.classified.mean,
        low: row.classified.low,
        high: row.classified.high,
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

/// Scores over M, a panel for each readout and kind of touches, a curve with its band for each designer.
fn charts(report: &SensingReport) -> Vec<Chart> {
    let mut readouts: Vec<&str> = Vec::new();
    for row in report.rows.iter().filter(|row| row.designer == "random") {
        if !readouts.contains(&&*row.readout) {
            readouts.push(&row.readout);
        }
    }
    let kinds = [("shapes", "Shapes, any place"), ("objects", "Objects, any place")];
    let images = report.rows.iter().map(|row| row.designer);
    let names: Vec<&str> = images.chain(report.classes.iter().map(|row| row.designer)).collect();
    let mut charts = Vec::new();
    for readout in readouts {
        for (touches, what) in kinds {
            let rows = report
                .rows
                .iter()
                .filter(|r| r.touches == touches && r.readout == readout);
            let points = rows.map(|r| (r.designer, r.m, r.iou));
            charts.push(chart(format!("{what}, {readout}"), "IoU", &names, points.collect()));
        }
        let rows = report.classes.iter().filter(|r| r.readout == readout);
        let points = rows.map(|r| (r.designer, r.m, r.classified));
        let title = format!("Seventeen classes, {readout}");
        charts.push(chart(title, "share classified", &names, points.collect()));
    }
    charts
}

/// A panel of points (designer, M, score). All panels name the designers `names`, and a designer looks alike in all.
fn chart(title: String, y_label: &str, names: &[&str], points: Vec<(&'static str, usize, Band)>) -> Chart {
    let inks = DESIGNERS.iter().zip(INKS.iter().cycle());
    let shown = inks.filter(|(designer, _)| names.contains(&designer.name));
    let series = shown.map(|(designer, (style, variant))| {
        let own = points.iter().filter(|p| p.0 == designer.name);
        let own: Vec<(f64, Band)> = own.map(|p| (p.1 as f64, p.2)).collect();
        let curve = own.iter().map(|(m, band)| (*m, band.mean)).collect();
        let shade = own.iter().map(|(m, band)| (*m, band.low, band.high)).collect();
        Series::new(designer.label, *style, *variant, curve).with_spans(shade)
    });
    Chart {
        title,
        x_label: "measurements M".to_owned(),
        y_label: y_label.to_owned(),
        y_range: Some((0.0, 1.0)),
        series: series.collect(),
        ..Chart::default()
    }
}
