//! The benchmark as a picture.

use crate::figures::{Chart, Claim, Series, Style};
use spts_recon::statistics::Band;
use spts_studies::readouts::{GOOD_IOU, READOUTS, ReadoutRow, ReadoutTrial, ReadoutsReport, SizeWire};

/// Number of the readout in the table: its ink, the same in every panel.
fn ink(row: &ReadoutRow) -> u8 {
    let place = READOUTS.iter().position(|line| line.name == row.readout);
    place.and_then(|place| u8::try_from(place).ok()).unwrap_or(0)
}

/// A curve with its bands: `at` says where on the horizontal axis a point is, and what it shows.
fn curve(rows: &[&ReadoutRow], points: Vec<(f64, Option<Band>)>) -> Option<Series> {
    let row = rows.first()?;
    let bands: Vec<(f64, Band)> = points.into_iter().filter_map(|(x, band)| Some((x, band?))).collect();
    let means = bands.iter().map(|(x, band)| (*x, band.mean)).collect();
    let spans = bands.iter().map(|(x, band)| (*x, band.low, band.high)).collect();
    Some(Series::new(row.label, Style::Alternative, ink(row), means).with_spans(spans))
}

/// Image and class over the number of measurements, size after size; then rate, latency and place over the number of
/// taxels.
pub(super) fn charts(report: &ReadoutsReport) -> Vec<Chart> {
    let mut charts = over_measurements(report, "Image", "IoU", &|t| t.iou);
    charts.extend(over_measurements(report, "17 objects", "share named rightly", &|t| {
        t.accuracy
    }));
    charts.push(Chart {
        published: report
            .published
            .iter()
            .map(|system| Claim {
                label: system.name.to_owned(),
                x: Some(system.taxels as f64),
                y: Some(system.frames_hz),
            })
            .collect(),
        ..over_taxels(
            report,
            &format!("Rate of images with IoU ≥ {GOOD_IOU}"),
            "images a second",
            &|row| {
                let hz = row.deciding().filter(|t| t.is_good())?.frames_hz;
                Some(Band {
                    mean: hz,
                    low: hz,
                    high: hz,
                })
            },
        )
    });
    let ms = |band: Band| Band {
        mean: 1e3 * band.mean,
        low: 1e3 * band.low,
        high: 1e3 * band.high,
    };
    charts.push(over_taxels(report, "From a touch to its place", "time, ms", &|row| {
        row.deciding()?.placed_s.map(ms)
    }));
    charts.push(over_taxels(report, "Error of the place", "taxels", &|row| {
        row.deciding()?.place_px
    }));
    charts
}

/// One share of every readout over the number of measurements, a chart a size.
fn over_measurements(
    report: &ReadoutsReport,
    what: &str,
    y_label: &str,
    value: &dyn Fn(&ReadoutTrial) -> Option<Band>,
) -> Vec<Chart> {
    let chart = |wire: &SizeWire| {
        let rows = report.rows.iter().filter(|row| row.taxels == wire.taxels);
        let series = rows.filter_map(|row| {
            let points = row.trials.iter().map(|t| (t.measurements as f64, value(t)));
            curve(&[row], points.collect())
        });
        Chart {
            title: format!("{what}, {} taxels", wire.taxels),
            x_label: "measurements M".to_owned(),
            y_label: y_label.to_owned(),
            x_log: true,
            y_range: Some((0.0, 1.0)),
            series: series.collect(),
            ..Chart::default()
        }
    };
    report.wires.iter().map(chart).collect()
}

/// One quantity of every readout over the number of taxels.
fn over_taxels(
    report: &ReadoutsReport,
    title: &str,
    y_label: &str,
    value: &dyn Fn(&ReadoutRow) -> Option<Band>,
) -> Chart {
    let series = READOUTS.iter().filter_map(|line| {
        let rows: Vec<&ReadoutRow> = report.rows.iter().filter(|row| row.readout == line.name).collect();
        let points = rows.iter().map(|row| (row.taxels as f64, value(row)));
        curve(&rows, points.collect())
    });
    Chart {
        title: title.to_owned(),
        x_label: "taxels".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        y_log: true,
        series: series.collect(),
        ..Chart::default()
    }
}
