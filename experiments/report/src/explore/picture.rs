//! The exploration as a picture.

use crate::figures::{Chart, Series, Style};
use spts_studies::explore::{ExploreReport, SizeRow, Way};

/// Ink of every way, in the order of [`Way::ALL`].
const STYLES: [(Style, u8); 4] = [
    (Style::Baseline, 0),
    (Style::Real, 0),
    (Style::Raster, 0),
    (Style::Twin, 0),
];

/// Measurements, acquisition and memory over the number of taxels: nothing that depends on the machine.
pub(super) fn charts(report: &ExploreReport) -> Vec<Chart> {
    vec![
        panel(report, "Measurements for an IoU of 0.8", "measurements", &|r| {
            r.m_iou.map(|m| m as f64)
        }),
        panel(
            report,
            "Measurements for 95 % of the contacts within 1 px",
            "measurements",
            &|r| r.m_located.map(|m| m as f64),
        ),
        panel(report, "Acquisition for an IoU of 0.8", "time, ms", &|r| {
            r.acquire_s.map(|s| s * 1e3)
        }),
        panel(report, "Scan of every taxel, for comparison", "time, ms", &|r| {
            Some(r.raster_s * 1e3)
        }),
        panel(report, "Memory of the decoder", "MB", &|r| {
            r.m_iou.and(r.deciding()).map(|t| t.bytes as f64 / 1e6)
        }),
    ]
}

/// Time of decoding, on this machine.
pub(super) fn timing(report: &ExploreReport) -> Chart {
    panel(report, "Decoding for an IoU of 0.8", "time, s", &|r| {
        r.m_iou.and(r.deciding()).map(|t| t.decode_s)
    })
}

/// One quantity in every way.
fn panel(report: &ExploreReport, title: &str, y_label: &str, value: &dyn Fn(&SizeRow) -> Option<f64>) -> Chart {
    let series = Way::ALL.into_iter().zip(STYLES).map(|(way, (arm, variant))| {
        let rows = report.rows.iter().filter(|r| r.way == way);
        let points = rows.filter_map(|r| Some((r.taxels as f64, value(r)?))).collect();
        Series::new(way.name(), arm, variant, points)
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
