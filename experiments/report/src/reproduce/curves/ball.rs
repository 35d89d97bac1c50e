//! The bouncing ball (Figs. 5B, 5C and 6).

use super::super::results::SkinResults;
use super::super::tracking::{TrackingRow, over_bounces};
use super::{BothSkins, as_f64, claim, over_m};
use crate::figures::{Chart, Series, StatedRange, Stroke, Style};
use spts_eval::decoders::{PublishedDecode, label};
use spts_eval::place::locator_label;

/// Numbers of measurements a frame in Fig. 5C, and the hue of each.
const FRAMES: [(usize, u8); 3] = [(25, 1), (50, 0), (100, 3)];
/// Locators in Fig. 6: the published ones, the best, and the middle of the sheet, which needs no measurement.
const LOCATORS: [&str; 4] = ["matched", "script_s5", "blob", "middle"];

impl BothSkins<'_> {
    /// Fig. 5B: what the number of measurements a frame does to the frames of a bounce.
    #[must_use]
    pub(in super::super) fn fig_5b(&self) -> Vec<Chart> {
        let curves = |get: fn(&TrackingRow) -> f64| -> Vec<Series> {
            let each = self.named().into_iter();
            each.map(|(results, whose, _)| {
                let points = results.tracking.iter().map(|t| (as_f64(t.m), get(t)));
                Self::skin_curve(whose, points.collect())
            })
            .collect()
        };
        let linear = |title: &str, y_label: &str, series: Vec<Series>, claims| Chart {
            x_log: false,
            y_range: None,
            ..over_m(title, y_label, series, claims)
        };
        vec![
            linear(
                "Change from frame to frame",
                "mean change of the largest taxel, V",
                curves(|t| t.mean_change_v),
                vec![],
            ),
            linear(
                "Frames in one contact",
                "mean number of frames",
                curves(|t| t.frames_in_contact),
                vec![claim("paper: 23 at M = 25", 25.0, 23.0)],
            ),
        ]
    }

    /// Fig. 5C: the largest taxel over time, median and middle half of all bounces.
    #[must_use]
    pub(in super::super) fn fig_5c(&self) -> Vec<Chart> {
        let curves = |results: &SkinResults| -> Vec<Series> {
            let each = FRAMES.iter().map(|&(m, hue)| {
                let courses = over_bounces(&results.traces, m);
                let points = courses.iter().map(|c| (c.time_ms, c.median_v)).collect();
                let scatter = courses.iter().map(|c| (c.time_ms, c.low_v, c.high_v)).collect();
                Series::new(format!("M = {m}"), Style::Alternative, hue, points).with_scatter(scatter)
            });
            each.collect()
        };
        let panels: Vec<_> = self
            .named()
            .into_iter()
            .map(|(results, whose, _)| {
                let skin = if whose.contains("real") { "Real skin" } else { "Twin" };
                (format!("{skin}, {} bounces", results.bounces.len()), curves(results))
            })
            .collect();
        let all = panels.iter().flat_map(|(_, series)| series);
        let highest_v = all
            .flat_map(|s| s.points.iter().map(|p| p.1).chain(s.scatter.iter().map(|r| r.2)))
            .fold(0.0, f64::max);
        let panel = |(title, series): (String, Vec<Series>)| Chart {
            title,
            x_label: "ms since first contact".to_owned(),
            y_label: "largest taxel, V".to_owned(),
            x_log: false,
            y_range: Some((0.0, 1.05 * highest_v)),
            ranges: vec![StatedRange {
                label: "paper: contact of about 8 ms".to_owned(),
                from: 0.0,
                to: 8.0,
            }],
            ..over_m("", "", series, vec![])
        };
        panels.into_iter().map(panel).collect()
    }

    /// Fig. 6: localisation.
    #[must_use]
    pub(in super::super) fn fig_6(&self) -> Vec<Chart> {
        let mut all = Vec::new();
        for locator in LOCATORS {
            for (results, whose, stroke) in self.named() {
                let rows = results.places.iter();
                let rows = rows.filter(|r| r.decoder == locator && !r.relabelled);
                let points: Vec<(f64, f64)> = rows.map(|r| (as_f64(r.m), r.mean_px)).collect();
                let (name, stroke) = match (locator, stroke) {
                    ("middle", Stroke::Solid) => ("always the middle of the skin", Stroke::Dotted),
                    ("middle", _) => ("always the middle of the skin", Stroke::DashDot),
                    ("matched", _) => (label(locator), stroke),
                    ("script_s5", _) => (label(PublishedDecode::ScriptS20.name()), stroke),
                    _ => (locator_label(locator), stroke),
                };
                all.push(Series::of_decoder(format!("{name}{whose}"), locator, stroke, points));
            }
        }
        let claims = vec![
            claim("paper: within 2 at M = 7", 7.0, 2.0),
            claim("paper: 1 at M = 25", 25.0, 1.0),
        ];
        vec![Chart {
            y_range: None,
            ..over_m(
                "Distance of the estimated centre of contact",
                "mean distance, taxels",
                all,
                claims,
            )
        }]
    }
}
