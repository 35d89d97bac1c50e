//! Timing as a picture.

use crate::figures::{Chart, Series, Style};
use spts_firmware::SKIN_SAMPLE_DELAY_S;
use spts_studies::firmware::{DESIGN_EDGE_HZ, ImageTiming};

/// Share of the flips that come late on the real skin: mean of the published recordings.
const SKIN_LATE_SHARE: f64 = 0.0018;
/// Delays that are drawn, eighths of a microsecond.
const DELAYS_EIGHTH_US: std::ops::RangeInclusive<u32> = 0..=120;
/// Smallest share of late flips that is drawn, %.
const LEAST_PERCENT: f64 = 0.01;

/// Lost edges over the clock's rate, and late flips over the time of the sample.
pub(super) fn charts(timings: &[ImageTiming]) -> Vec<Chart> {
    let curves = |points: &dyn Fn(&ImageTiming) -> Vec<(f64, f64)>| -> Vec<Series> {
        let curve = |(index, timing): (usize, &ImageTiming)| {
            let style = if index == 0 { Style::Twin } else { Style::Raster };
            let variant = u8::try_from(index.saturating_sub(1)).unwrap_or(u8::MAX);
            Series::new(timing.image.as_str(), style, variant, points(timing))
        };
        timings.iter().enumerate().map(curve).collect()
    };
    let mut lost = curves(&|timing| {
        let seen = timing
            .lost
            .iter()
            .filter_map(|lost| Some((lost.edge_hz / 1e3, 100.0 * lost.share?)));
        seen.collect()
    });
    let design_khz = DESIGN_EDGE_HZ / 1e3;
    lost.push(bound("clock of 72 kHz", 0, design_khz, (0.0, 100.0)));
    let mut late = curves(&|timing| {
        let delays = DELAYS_EIGHTH_US.map(|eighth| f64::from(eighth) / 8.0);
        delays
            .map(|us| (us, 100.0 * timing.late.share_beyond(us * 1e-6)))
            .collect()
    });
    late.push(bound(
        "sample of the published script, 11 µs",
        1,
        SKIN_SAMPLE_DELAY_S * 1e6,
        (LEAST_PERCENT, 100.0),
    ));
    let ends_us = [0.0, f64::from(*DELAYS_EIGHTH_US.end()) / 8.0];
    let skin = ends_us.map(|us| (us, 100.0 * SKIN_LATE_SHARE));
    late.push(Series::new(
        "real skin, mean of its recordings",
        Style::Real,
        0,
        skin.to_vec(),
    ));
    vec![
        Chart {
            title: "A clock that is too fast, binary mode".to_owned(),
            x_label: "clock, thousand edges a second".to_owned(),
            y_label: "edges lost, %".to_owned(),
            y_range: Some((0.0, 100.0)),
            series: lost,
            ..Chart::default()
        },
        Chart {
            title: "Updates after the sample, binary mode at 64.3 kHz".to_owned(),
            x_label: "time from the edge to the sample, µs".to_owned(),
            y_label: "late flips, %".to_owned(),
            y_log: true,
            y_range: Some((LEAST_PERCENT, 100.0)),
            series: late,
            ..Chart::default()
        },
    ]
}

/// A vertical line at `x`.
fn bound(name: &str, variant: u8, x: f64, (low, high): (f64, f64)) -> Series {
    Series::new(name, Style::Baseline, variant, vec![(x, low), (x, high)])
}
