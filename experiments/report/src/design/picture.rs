//! A design as a picture: image and place against time, and what else there is.

use crate::figures::{Chart, Claim, Series, Style};
use spts_studies::design::{DesignCurve, DesignPoint, DesignReport, RowSource};

/// Vertical axis of IoU.
const IOU: (f64, f64) = (0.0, 1.0);

/// IoU and place error against the time of acquisition, with the target, the latency and the design itself.
pub(super) fn charts(report: &DesignReport) -> Vec<Chart> {
    let d = &report.design;
    let limit_ms = 1e3 * report.latency.limit_s;
    let (target, latency) = (
        Claim {
            label: format!("IoU {} asked for", report.iou_wanted),
            x: None,
            y: Some(report.iou_wanted),
        },
        Claim {
            label: format!("latency {limit_ms} ms"),
            x: Some(limit_ms),
            y: None,
        },
    );
    let at = 1e3 * report.latency.acquisition_s;
    let e = &d.expected;
    let mut image = curves(report, &|p| p.iou.mean);
    for (name, of) in [
        ("90 % band of the mean", (|p: &DesignPoint| p.iou.low) as fn(&DesignPoint) -> f64),
        ("", |p: &DesignPoint| p.iou.high),
    ] {
        let own = report.curves.iter().filter(|c| c.rows == d.row_source && c.wires == d.wires);
        image.extend(own.map(|c| Series::new(name, Style::Paper, 0, points(report, c, &of))));
    }
    image.push(Series::new(
        "the design, and the band of its check",
        Style::Raster,
        0,
        vec![(at, e.iou.low), (at, e.iou.mean), (at, e.iou.high)],
    ));
    let mut place = curves(report, &|p| 1e3 * d.pitch_m * p.place_px);
    place.push(Series::new(
        "the design, and the band of its check",
        Style::Raster,
        0,
        vec![(at, e.place_mm.low), (at, e.place_mm.mean), (at, e.place_mm.high)],
    ));
    let panel = |title: String, y_label: &str, series: Vec<Series>, claims: Vec<Claim>| Chart {
        title,
        x_label: "acquisition, ms".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        series,
        claims,
        ..Chart::default()
    };
    let wires = if d.wires == 1 { "1 wire".to_owned() } else { format!("{} wires", d.wires) };
    let title = format!(
        "{} × {} taxels at {:.4} mm, {wires}, M = {}",
        d.rows,
        d.cols,
        1e3 * d.pitch_m,
        d.m
    );
    vec![
        Chart {
            y_range: Some(IOU),
            ..panel(title, "IoU", image, vec![target, latency.clone()])
        },
        panel(
            "Place of the touch".to_owned(),
            "median place error, mm",
            place,
            vec![latency],
        ),
    ]
}

/// A curve of everything that was tried with as many wires as the design, and with fewer.
fn curves(report: &DesignReport, of: &dyn Fn(&DesignPoint) -> f64) -> Vec<Series> {
    let several = report.curves.iter().any(|c| c.wires != report.design.wires);
    let series = report.curves.iter().map(|c| {
        let name = match (&c.rows, several) {
            (rows, false) => format!("{} rows", plain(rows)),
            (rows, true) => format!("{} rows, wires: {}", plain(rows), c.wires),
        };
        let style = match c.rows {
            RowSource::Generator => Style::Twin,
            RowSource::Designer(_) => Style::Baseline,
        };
        let like = report
            .curves
            .iter()
            .take_while(|other| !std::ptr::eq(*other, c))
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
