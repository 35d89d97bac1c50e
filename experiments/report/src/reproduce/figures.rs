//! The table of the report's figures, and its line charts. A new figure is a function here or in `sheets`, and a line
//! in the table.

use super::dataset::SimulatedData;
use super::results::{BEST, BothSkins, SkinResults, TimingRow};
use super::sheets;
use super::tables::CorrelationRow;
use super::tracking::{TrackingRow, over_bounces};
use crate::figures::{Chart, Series, Sheet, Stroke, Style, save_charts, save_sheet};
use spts_eval::decoders::label;
use spts_eval::place::locator_label;
use spts_eval::{BaselineRow, RASTER, ScoreRow, unique};
use std::path::Path;

/// What figures are drawn from.
pub(super) struct Shown<'a> {
    pub(super) dataset: &'a SimulatedData,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) timings: &'a [TimingRow],
}

/// What a figure is drawn from.
pub(super) enum Drawing {
    Charts(Vec<Chart>),
    Sheet(Sheet),
}

use Drawing::{Charts, Sheet as Images};
use spts_input::Refusal;

/// How a figure is drawn.
type Draw = fn(&Shown<'_>) -> Drawing;

/// Every figure of the paper: its file, and how it is drawn. `page.toml` has its words.
pub(super) const FIGURES: &[(&str, Draw)] = &[
    ("s5_objects.png", |s| Images(sheets::objects(s.dataset, s.skins, s.correlations))),
    ("3b_classification", |s| Charts(s.skins.fig_3b())),
    ("3c_support", |s| Charts(s.skins.fig_3c())),
    ("3d_frequency", |s| Charts(s.skins.fig_3d(s.timings))),
    ("3e_latency", |s| Charts(s.skins.fig_3e())),
    ("4_adaptive.png", |s| Images(sheets::adaptive(s.skins, s.dataset.cols))),
    ("s4_examples.png", |s| Images(sheets::examples(s.skins, s.dataset.cols))),
    ("s6_dictionary.png", |s| Images(sheets::dictionaries(s.skins, s.dataset.cols))),
    ("5b_change", |s| Charts(s.skins.fig_5b())),
    ("5c_peak", |s| Charts(s.skins.fig_5c())),
    ("6_localisation", |s| Charts(s.skins.fig_6())),
];

/// Draws all figures into `dir`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(super) fn draw(dir: &Path, shown: &Shown<'_>) -> Result<(), Refusal> {
    for (file, draw) in FIGURES {
        let name = file.trim_end_matches(".png");
        match draw(shown) {
            Charts(charts) => save_charts(&charts, dir, name)?,
            Images(sheet) => save_sheet(&sheet, dir, name)?,
        }
    }
    Ok(())
}

/// Numbers of measurements with which the paper finds small objects reconstructed well enough, and large ones.
const STATED: [(&str, f64, f64); 2] =
    [("paper: 15–20 for small objects", 15.0, 20.0), ("paper: 25–30 for large objects", 25.0, 30.0)];
/// Numbers of measurements a frame in Fig. 5C, and the hue of each.
const FRAMES: [(usize, u8); 3] = [(25, 1), (50, 0), (100, 3)];
/// Locators in Fig. 6: the published ones, the best, and the middle of the sheet, which needs no measurement.
const LOCATORS: [&str; 4] = ["matched", "script_s5", "blob", "middle"];

fn as_f64(m: usize) -> f64 {
    m as f64
}

fn over_m(title: &str, y_label: &str, series: Vec<Series>) -> Chart {
    Chart {
        title: title.to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        y_range: Some((0.0, 1.02)),
        series,
        ..Chart::default()
    }
}

/// Whether curves with this name are of the real skin, and their looks where a chart has one curve for each skin.
fn skin_curve(whose: &str, points: impl Iterator<Item = (f64, f64)>) -> Series {
    let (name, style) = if whose.contains("real") { ("real skin", Style::Real) } else { ("twin", Style::Twin) };
    Series::new(name, style, 0, points.collect())
}

impl BothSkins<'_> {
    /// One score as panels: all decoders in one, or with recordings the published and the best ones in two. Curves are
    /// means over the objects of [`BothSkins::common`].
    fn panels(&self, title: &str, y_label: &str, get: fn(&ScoreRow) -> f64, base: &Series) -> Vec<Chart> {
        let published = ["matched", "script_s20", RASTER];
        let groups = if self.real.is_some() {
            let best = [&published[..1], &BEST[..]].concat();
            vec![(": published decoders", published.to_vec()), (": best decoders", best)]
        } else {
            vec![("", [&published[..], &BEST[..]].concat())]
        };
        let panel = |(group, decodes): (&str, Vec<&str>)| {
            let mut series = Vec::new();
            for decode in decodes {
                for (results, whose, stroke) in self.named() {
                    let rows = results.scores.rows.iter();
                    let rows = rows.filter(|r| r.object == self.common() && r.decode == decode);
                    let points: Vec<(f64, f64)> = rows.map(|r| (as_f64(r.m), get(r))).collect();
                    if !points.is_empty() {
                        let name = format!("{}{whose}", label(decode));
                        series.push(Series::of_decoder(name, decode, stroke, points));
                    }
                }
            }
            series.push(base.clone());
            over_m(&format!("{title}{group}"), y_label, series)
        };
        groups.into_iter().map(panel).collect()
    }

    /// A level that needs no measurement.
    fn level(&self, name: &str, height: f64) -> Series {
        let ends = self.twin.scores.rows.iter().map(|r| as_f64(r.m));
        let (low, high) = ends.fold((f64::INFINITY, 0.0_f64), |(l, h), m| (l.min(m), h.max(m)));
        Series::of_decoder(name, "empty", Stroke::Dotted, vec![(low, height), (high, height)])
    }

    fn empty_image(&self, get: fn(&BaselineRow) -> f64) -> Series {
        let of = |b: &&BaselineRow| b.object == self.common() && b.baseline == "empty";
        let found = self.real.unwrap_or(self.twin).scores.baselines.iter().find(of);
        self.level("an empty image", found.map_or(f64::NAN, get))
    }

    /// Fig. 3B: classification.
    fn fig_3b(&self) -> Vec<Chart> {
        let labels = unique(self.twin.skin.learned.classifier.library().labels());
        let classes = labels.len().max(1);
        let chance = self.level(&format!("chance, 1 in {classes}"), 1.0 / as_f64(classes));
        let right = "share classified correctly";
        let votes = self.panels("Votes of 20 windows", right, |r| r.class_vote20, &chance);
        let votes = votes.into_iter().map(|chart| {
            chart.with_claims(&[
                ("paper: at least 0.80 at M = 13", 13.0, 0.80),
                ("paper: at least 0.98 at M = 20", 20.0, 0.98),
            ])
        });
        votes.chain(self.panels("Single windows", right, |r| r.class_single, &chance)).collect()
    }

    /// Fig. 3C: support of the reconstruction.
    fn fig_3c(&self) -> Vec<Chart> {
        let empty = self.empty_image(|b| b.support);
        let support = self.panels("Support accuracy", "taxels on the right side", |r| r.support, &empty);
        let support = support.into_iter().map(|chart| Chart { y_range: Some((0.5, 1.01)), ..chart });
        let nothing = self.empty_image(|b| b.iou);
        let iou = self.panels("Intersection over union", "IoU of the support", |r| r.iou, &nothing);
        support.chain(iou).map(|chart| chart.with_ranges(&STATED)).collect()
    }

    /// Fig. 3D: frames a second, acquired and decoded.
    fn fig_3d(&self, timings: &[TimingRow]) -> Vec<Chart> {
        let over = |khz: &dyn Fn(&TimingRow) -> f64| timings.iter().map(|t| (as_f64(t.m), khz(t))).collect();
        let acquired = |rate_hz: f64| over(&|t| rate_hz / as_f64(t.m) * 1e-3);
        let mut all = Vec::new();
        if let Some(raster) = self.twin.skin.sessions.first().and_then(|s| s.raster.as_ref()) {
            let rate_hz = raster.sample_rate_hz();
            let name = format!("acquired, {:.1} kHz as recorded", rate_hz * 1e-3);
            all.push(Series::new(name, Style::Twin, 0, acquired(rate_hz)));
        }
        let (decoded, paper) = ("decoded, one thread of this machine", "acquired, 70 kHz as in the paper");
        all.push(Series::new(decoded, Style::Baseline, 0, over(&|t| 1e3 / t.decode_us_median)));
        all.push(Series::new(paper, Style::Paper, 0, acquired(70e3)));
        let chart = Chart { y_log: true, y_range: None, ..over_m("Frame rate", "frames a second, thousands", all) };
        vec![chart.with_claims(&[("paper: 3500 at M = 20", 20.0, 3.5), ("paper: 5400 at M = 13", 13.0, 5.4)])]
    }

    /// Fig. 3E: classification over time.
    fn fig_3e(&self) -> Vec<Chart> {
        let panel = |title: &str, x_label: &str, rule: &'static str, measurements: &[usize]| Chart {
            x_label: x_label.to_owned(),
            x_log: false,
            ..over_m(title, "share classified correctly", self.latencies(rule, measurements))
        };
        let published = "From 100 frames after contact, as published";
        let published = panel(published, "ms of data", "published", &[25, 50, 100]);
        let contact = panel("From first contact, one window", "ms since first contact", "contact", &[25, 100]);
        vec![published.with_claims(&[("paper: 80 % in 0.4 ms", 0.4, 0.8)]), contact]
    }

    fn latencies(&self, rule: &'static str, measurements: &[usize]) -> Vec<Series> {
        let mut all = Vec::new();
        for (results, whose, _) in self.named() {
            let (kind, raster) =
                if whose.contains("real") { (Style::Real, Style::RasterReal) } else { (Style::Twin, Style::Raster) };
            let curve = |decode: &str, m: usize| -> Vec<(f64, f64)> {
                let rows = results.latency.iter();
                let of = rows.filter(|r| r.rule == rule && r.decode == decode && r.m == m);
                of.map(|r| (r.time_ms, r.accuracy)).collect()
            };
            for (variant, &m) in (0_u8..).zip(measurements) {
                all.push(Series::new(format!("M = {m}{whose}"), kind, variant, curve("matched", m)));
            }
            let points = curve(RASTER, 100);
            if !points.is_empty() {
                all.push(Series::new(format!("raster scan{whose}"), raster, 0, points));
            }
        }
        all
    }

    /// Fig. 5B: what the number of measurements a frame does to the frames of a bounce.
    fn fig_5b(&self) -> Vec<Chart> {
        let panel = |title: &str, y_label: &str, get: fn(&TrackingRow) -> f64| {
            let curves = self
                .named()
                .into_iter()
                .map(|(results, whose, _)| skin_curve(whose, results.tracking.iter().map(|t| (as_f64(t.m), get(t)))));
            Chart { x_log: false, y_range: None, ..over_m(title, y_label, curves.collect()) }
        };
        let change = "mean change of the largest taxel, V";
        let frames = panel("Frames in one contact", "mean number of frames", |t| t.frames_in_contact);
        vec![
            panel("Change from frame to frame", change, |t| t.mean_change_v),
            frames.with_claims(&[("paper: 23 at M = 25", 25.0, 23.0)]),
        ]
    }

    /// Fig. 5C: the largest taxel over time, median and middle half of all bounces.
    fn fig_5c(&self) -> Vec<Chart> {
        let curve = |results: &SkinResults, (m, hue): (usize, u8)| {
            let courses = over_bounces(&results.traces, m);
            let points = courses.iter().map(|c| (c.time_ms, c.median_v)).collect();
            let scatter = courses.iter().map(|c| (c.time_ms, c.low_v, c.high_v)).collect();
            Series::new(format!("M = {m}"), Style::Alternative, hue, points).with_scatter(scatter)
        };
        let panels = self.named().into_iter().map(|(results, whose, _)| {
            let skin = if whose.contains("real") { "Real skin" } else { "Twin" };
            let title = format!("{skin}, {} bounces", results.bounces.len());
            let chart = Chart {
                x_label: "ms since first contact".to_owned(),
                x_log: false,
                ..over_m(&title, "largest taxel, V", FRAMES.map(|frame| curve(results, frame)).to_vec())
            };
            chart.with_ranges(&[("paper: contact of about 8 ms", 0.0, 8.0)])
        });
        let mut panels: Vec<Chart> = panels.collect();
        let all = panels.iter().flat_map(|chart| &chart.series);
        let highest_v =
            all.flat_map(|s| s.points.iter().map(|p| p.1).chain(s.scatter.iter().map(|r| r.2))).fold(0.0, f64::max);
        panels.iter_mut().for_each(|chart| chart.y_range = Some((0.0, 1.05 * highest_v)));
        panels
    }

    /// Fig. 6: localisation.
    fn fig_6(&self) -> Vec<Chart> {
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
                    ("script_s5", _) => (label("script_s20"), stroke),
                    _ => (locator_label(locator), stroke),
                };
                all.push(Series::of_decoder(format!("{name}{whose}"), locator, stroke, points));
            }
        }
        let chart = Chart {
            y_range: None,
            ..over_m("Distance of the estimated centre of contact", "mean distance, taxels", all)
        };
        vec![chart.with_claims(&[("paper: within 2 at M = 7", 7.0, 2.0), ("paper: 1 at M = 25", 25.0, 1.0)])]
    }
}
