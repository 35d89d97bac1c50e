//! How fast (Figs. 3D and 3E).

use super::super::latency::LatencyRow;
use super::super::results::SkinResults;
use super::super::timing::TimingRow;
use super::{BothSkins, as_f64, claim, over_m};
use crate::figures::{Chart, Series, Style};
use spts_eval::RASTER;
use spts_eval::decoders::PublishedDecode;

impl BothSkins<'_> {
    /// Fig. 3D: frames a second, acquired and decoded.
    #[must_use]
    pub(in super::super) fn fig_3d(&self, timings: &[TimingRow]) -> Vec<Chart> {
        let khz = |rate_hz: f64| {
            timings
                .iter()
                .map(|t| (as_f64(t.m), rate_hz / as_f64(t.m) * 1e-3))
                .collect()
        };
        let mut all = Vec::new();
        if let Some(raster) = self.twin.skin.sessions.first().and_then(|s| s.raster.as_ref()) {
            let rate_hz = raster.sample_rate_hz();
            let name = format!("acquired, {:.1} kHz as recorded", rate_hz * 1e-3);
            all.push(Series::new(name, Style::Twin, 0, khz(rate_hz)));
        }
        let decoded = timings.iter().map(|t| (as_f64(t.m), 1e3 / t.decode_us_median));
        all.push(Series::new(
            "decoded, one thread of this machine",
            Style::Baseline,
            0,
            decoded.collect(),
        ));
        all.push(Series::new(
            "acquired, 70 kHz as in the paper",
            Style::Paper,
            0,
            khz(70e3),
        ));
        vec![Chart {
            y_log: true,
            y_range: None,
            ..over_m(
                "Frame rate",
                "frames a second, thousands",
                all,
                vec![
                    claim("paper: 3500 at M = 20", 20.0, 3.5),
                    claim("paper: 5400 at M = 13", 13.0, 5.4),
                ],
            )
        }]
    }

    /// Fig. 3E: classification over time.
    #[must_use]
    pub(in super::super) fn fig_3e(&self) -> Vec<Chart> {
        let panel = |title: &str, x_label: &str, rule: &'static str, measurements: &[usize], claims| Chart {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            x_log: false,
            claims,
            ..over_m(
                "",
                "share classified correctly",
                self.latencies(rule, measurements),
                vec![],
            )
        };
        vec![
            panel(
                "From 100 frames after contact, as published",
                "ms of data",
                "published",
                &[25, 50, 100],
                vec![claim("paper: 80 % in 0.4 ms", 0.4, 0.8)],
            ),
            panel(
                "From first contact, one window",
                "ms since first contact",
                "contact",
                &[25, 100],
                vec![],
            ),
        ]
    }

    fn latencies(&self, rule: &'static str, measurements: &[usize]) -> Vec<Series> {
        let curve = |rows: &[LatencyRow], decode: &str, m: usize| -> Vec<(f64, f64)> {
            let of = rows.iter().filter(|r| r.rule == rule && r.decode == decode && r.m == m);
            of.map(|r| (r.time_ms, r.accuracy)).collect()
        };
        let mut all = Vec::new();
        let mut add = |whose: &str, kind: Style, raster: Style, results: &SkinResults| {
            for (variant, &m) in (0_u8..).zip(measurements) {
                let points = curve(&results.latency, PublishedDecode::Matched.name(), m);
                all.push(Series::new(format!("M = {m}{whose}"), kind, variant, points));
            }
            let points = curve(&results.latency, RASTER, 100);
            if !points.is_empty() {
                all.push(Series::new(format!("raster scan{whose}"), raster, 0, points));
            }
        };
        if let Some(real) = self.real {
            add(", twin", Style::Twin, Style::Raster, self.twin);
            add(", real skin", Style::Real, Style::RasterReal, real);
        } else {
            add("", Style::Twin, Style::Raster, self.twin);
        }
        all
    }
}
