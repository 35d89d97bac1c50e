//! A design as a picture: image and place against time, and what else there is.

use crate::figures::{Chart, Series, Style};
use spts_studies::design::{DesignCurve, DesignPoint, DesignReport, RowSource};

/// Vertical axis of IoU.
const IOU: (f64, f64) = (0.0, 1.0);

/// IoU and place error against the time of acquisition, with the target, the latency and the design itself.
pub(super) fn charts(report: &DesignReport) -> Vec<Chart> {
    let (d, e) = (&report.design, &report.design.expected);
    let (limit_ms, at) = (1e3 * report.latency.limit_s, 1e3 * report.latency.acquisition_s);
    let mm = |p: &DesignPoint| 1e3 * d.pitch_m * p.place_px;
    let mut image = curves(report, &|p| p.iou.mean);
    let mut place = curves(report, &mm);
    for (series, band) in [(&mut image, &e.iou), (&mut place, &e.place_mm)] {
        let points = vec![(at, band.low), (at, band.mean), (at, band.high)];
        series.push(Series::new(
            "the design, with the band of its check",
            Style::Raster,
            0,
            points,
        ));
    }
    let times = image.iter().flat_map(|s| s.points.iter().map(|(t, _)| *t));
    let first = times.fold(limit_ms, f64::min);
    let farthest = place
        .iter()
        .flat_map(|s| s.points.iter().map(|(_, mm)| *mm))
        .fold(0.0, f64::max);
    let level = vec![(first, report.iou_wanted), (limit_ms, report.iou_wanted)];
    image.push(Series::new(
        format!("IoU of {} asked for", report.iou_wanted),
        Style::Paper,
        0,
        level,
    ));
    for (series, top) in [(&mut image, IOU.1), (&mut place, farthest)] {
        let line = vec![(limit_ms, 0.0), (limit_ms, top)];
        series.push(Series::new(format!("latency of {limit_ms} ms"), Style::Paper, 1, line));
    }
    let wires = if d.wires == 1 {
        "1 wire".to_owned()
    } else {
        format!("{} wires", d.wires)
    };
    // three digits behind the point at most
    let pitch_mm = (1e6 * d.pitch_m).round() / 1e3;
    let title = format!("{} × {} taxels, {pitch_mm} mm, {wires}, M = {}", d.rows, d.cols, d.m);
    let panel = |title: String, y_label: &str, series: Vec<Series>| Chart {
        title,
        x_label: "acquisition, ms".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        series,
        ..Chart::default()
    };
    vec![
        Chart {
            y_range: Some(IOU),
            ..panel(title, "IoU", image)
        },
        panel("Place of the touch".to_owned(), "median place error, mm", place),
    ]
}

/// A curve of everything that was tried with as many wires as the design, and with one.
fn curves(report: &DesignReport, of: &dyn Fn(&DesignPoint) -> f64) -> Vec<Series> {
    let wires = report.design.wires;
    let several = wires > 1;
    let shown: Vec<&DesignCurve> = report
        .curves
        .iter()
        .filter(|c| c.wires == wires || c.wires == 1)
        .collect();
    let series = shown.iter().map(|c| {
        let name = match (&c.rows, several) {
            (rows, false) => format!("{} rows", plain(rows)),
            (rows, true) => format!("{} rows, wires: {}", plain(rows), c.wires),
        };
        let style = match c.rows {
            RowSource::Generator => Style::Twin,
            RowSource::Designer(_) => Style::Baseline,
        };
        let like = shown
            .iter()
            .take_while(|other| !std::ptr::eq(**other, *c))
            .filter(|other| (other.rows == RowSource::Generator) == (c.rows == RowSource::Generator));
        let variant = u8::try_from(like.count() % 4).unwrap_or_default();
        Series::new(name, style, variant, points(report, c, of))
    });
    series.collect()
}

/// Name of rows in the figure.
fn plain(rows: &RowSource) -> String {
    rows.name().replace('_', " ")
}

/// Points of a curve, ms.
fn points(report: &DesignReport, curve: &DesignCurve, of: &dyn Fn(&DesignPoint) -> f64) -> Vec<(f64, f64)> {
    let period_ms = 1e3 * report.design.wire.period_s;
    let point = |p: &DesignPoint| (p.m_per_wire as f64 * period_ms, of(p));
    curve.points.iter().map(point).collect()
}
