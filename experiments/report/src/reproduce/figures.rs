//! The table of the report's figures, and its line charts. A new figure is a function here or in `sheets`, and a line
//! in the table.

use super::dataset::SimulatedData;
use super::latency::LatencyRow;
use super::results::{BEST, BothSkins, SkinResults, TimingRow};
use super::sheets;
use super::tables::CorrelationRow;
use super::tracking::{TrackingRow, over_bounces};
use crate::figures::{Chart, Claim, Series, Sheet, StatedRange, Stroke, Style, save_charts, save_sheet};
use spts::output::OutputError;
use spts_eval::decoders::{PublishedDecode, label};
use spts_eval::place::locator_label;
use spts_eval::{BaselineRow, RASTER, ScoreRow};
use std::path::Path;

/// What figures are drawn from.
pub(super) struct Shown<'a> {
    pub(super) dataset: &'a SimulatedData,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) timings: &'a [TimingRow],
}

/// A figure before it is written.
pub(super) enum Drawing {
    /// Panels of curves.
    Charts(Vec<Chart>),
    /// Images.
    Sheet(Sheet),
}

use Drawing::{Charts, Sheet as Images};

/// A line of the table.
pub(super) struct FigureLine {
    /// Section of the page.
    pub(super) section: &'static str,
    /// File, with `.png` where the page shows pixels.
    pub(super) file: &'static str,
    /// What is to be seen, for those who cannot see it.
    pub(super) alt: &'static str,
    /// What it means.
    pub(super) caption: &'static str,
    /// What the caption says more when the real skin stands beside the twin.
    pub(super) compared: Option<&'static str>,
    draw: fn(&Shown<'_>) -> Drawing,
}

/// Every figure, in the order of the page.
pub(super) const FIGURES: &[FigureLine] = &[
    FigureLine {
        section: "objects",
        file: "s5_objects.png",
        alt: "Seventeen rows of pictures: each object on the skin, the pressure on the 10 by 10 taxels, and the raster image.",
        caption: "As Fig. S5 of the paper: its 17 objects, rebuilt from their names and raster images. The raster images are \
                  mottled where the pressure is even: every taxel has a gain of its own, as on a real skin, and they differ by \
                  some 20 %.",
        compared: Some(
            "The simulated gains are drawn at random, so the mottle of twin and real skin cannot agree; r is the correlation of \
             their raster images (median over presses), which the gains keep below 1.",
        ),
        draw: |s| Images(sheets::objects(s.dataset, s.skins, s.correlations)),
    },
    FigureLine {
        section: "classification",
        file: "3b_classification",
        alt: "Curves of the share of correctly classified windows, which rise with the number of measurements M; stars mark what the paper states.",
        caption: "As Fig. 3B: how often the right object is named, of 17, mean over the objects. A vote of 20 windows takes 20 \
                  times as long as a single window.",
        compared: Some(
            "Means are over the objects that both skins recorded in compressed form. The published library holds some of the \
             very frames that the real skin's raster scan is scored on; nothing else is scored on what was learned.",
        ),
        draw: |s| Charts(s.skins.fig_3b()),
    },
    FigureLine {
        section: "classification",
        file: "3c_support",
        alt: "Curves of support accuracy and of intersection over union, which rise with the number of measurements M; shades mark the ranges of the paper.",
        caption: "As Fig. 3C: how well the decoded image shows which taxels are touched, mean over the objects. Support accuracy \
                  is the paper's measure. It counts untouched taxels too, so an empty image already scores well; IoU does not reward it.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3c()),
    },
    FigureLine {
        section: "classification",
        file: "3d_frequency",
        alt: "Falling lines of frames a second over the number of measurements M, acquired and decoded, with two stars from the paper.",
        caption: "As Fig. 3D: images a second. The wire delivers the blue line; decoding keeps up where the green line lies above it.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3d(s.timings)),
    },
    FigureLine {
        section: "classification",
        file: "3e_latency",
        alt: "Curves of the share of presses classified correctly over milliseconds, for several M.",
        caption: "As Fig. 3E: how soon a press is recognised, by the published decoder; mean over presses. Left: the published \
                  rule begins 100 frames after contact. Right: from first contact on, while the force still rises.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3e()),
    },
    FigureLine {
        section: "adaptive",
        file: "4_adaptive.png",
        alt: "Rows of tactile images that sharpen from 2 to 15 measurements, above them bars of the measurements used.",
        caption: "As Fig. 4, where the paper's T is distinct at 15 measurements. This is one window of one press, neither the \
                  best nor the worst: from how many measurements on a T is seen differs from window to window. The \
                  evidence decoder has learned from raster images of this very object. It shows a mixture of objects until \
                  it recognises one, and then the whole T; of an object that it has never felt it would show another.",
        compared: Some("The published compressed recordings hold no T; the rectangle stands in for both skins."),
        draw: |s| Images(sheets::adaptive(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "adaptive",
        file: "s4_examples.png",
        alt: "Rows of tactile images of five objects at 5 to 100 measurements, beside their raster images.",
        caption: "As Fig. S4: one window of each object at several M. The paper finds 15 to 20 measurements enough for small \
                  objects and 25 to 30 for large ones.",
        compared: None,
        draw: |s| Images(sheets::examples(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "adaptive",
        file: "s6_dictionary.png",
        alt: "Small tactile images: the first 40 atoms of the dictionary.",
        caption: "As Fig. S6: the patterns from which the published decoder composes an image, 40 of 100.",
        compared: Some("Below the twin's, those that were published with the real skin."),
        draw: |s| Images(sheets::dictionaries(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "bounce",
        file: "5b_change",
        alt: "Two charts over the measurements a frame: the mean change from frame to frame rises, the frames in a contact fall.",
        caption: "As Fig. 5B: the fewer measurements a frame has, the more frames fall into one contact, and the less changes \
                  from one to the next. Means over all bounces.",
        compared: None,
        draw: |s| Charts(s.skins.fig_5b()),
    },
    FigureLine {
        section: "bounce",
        file: "5c_peak",
        alt: "Humps of the largest taxel over milliseconds for 25, 50 and 100 measurements a frame, with shades of their scatter.",
        caption: "As Fig. 5C: the largest taxel of the decoded image while the ball touches. Lines are medians over all bounces, \
                  shades hold the middle half of them, and every marker is a frame.",
        compared: None,
        draw: |s| Charts(s.skins.fig_5c()),
    },
    FigureLine {
        section: "bounce",
        file: "6_localisation",
        alt: "Falling curves of the distance to the true centre over the number of measurements M, with the level of a guess and two stars from the paper.",
        caption: "As Fig. 6: how far the estimated centre of the contact is from the true one, mean over all bounces. The drops fall around \
                  the middle of the skin, so to say “the middle” without a measurement is already as good as the grey \
                  line: only what lies below it has learned a place from the wire.",
        compared: None,
        draw: |s| Charts(s.skins.fig_6()),
    },
];

/// Writes every figure, as .svg and .png, into the folder `dir`.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub(super) fn draw(dir: &Path, shown: &Shown<'_>) -> Result<(), OutputError> {
    for figure in FIGURES {
        let name = figure.file.trim_end_matches(".png");
        match (figure.draw)(shown) {
            Charts(charts) => save_charts(&charts, dir, name)?,
            Images(sheet) => save_sheet(&sheet, dir, name)?,
        }
    }
    Ok(())
}

/// Numbers of measurements with which the paper finds small objects reconstructed well enough, and large ones.
const STATED: [(&str, f64, f64); 2] = [
    ("paper: 15–20 for small objects", 15.0, 20.0),
    ("paper: 25–30 for large objects", 25.0, 30.0),
];

fn as_f64(m: usize) -> f64 {
    m as f64
}

fn board(results: &SkinResults, object: &str, decode: &str, get: fn(&ScoreRow) -> f64) -> Vec<(f64, f64)> {
    let rows = results
        .scores
        .rows
        .iter()
        .filter(|r| r.object == object && r.decode == decode);
    rows.map(|r| (as_f64(r.m), get(r))).collect()
}

fn claim(label: &str, x: f64, y: f64) -> Claim {
    Claim {
        label: label.to_owned(),
        x: Some(x),
        y: Some(y),
    }
}

fn over_m(title: &str, y_label: &str, series: Vec<Series>, claims: Vec<Claim>) -> Chart {
    Chart {
        title: title.to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        y_log: false,
        y_range: Some((0.0, 1.02)),
        series,
        claims,
        ..Chart::default()
    }
}

impl BothSkins<'_> {
    /// Curves of one score, means over the objects of [`BothSkins::common`].
    fn scores(&self, decodes: &[&str], get: fn(&ScoreRow) -> f64) -> Vec<Series> {
        let mut all = Vec::new();
        for decode in decodes {
            for (results, whose, stroke) in self.named() {
                let points = board(results, self.common(), decode, get);
                if !points.is_empty() {
                    let name = format!("{}{whose}", label(decode));
                    all.push(Series::of_decoder(name, decode, stroke, points));
                }
            }
        }
        all
    }

    /// One score as panels: all decoders in one, or with recordings the published and the best ones in two.
    fn panels(
        &self,
        title: &str,
        y_label: &str,
        get: fn(&ScoreRow) -> f64,
        claims: &[Claim],
        base: &Series,
    ) -> Vec<Chart> {
        let matched = PublishedDecode::Matched.name();
        let published = [matched, PublishedDecode::ScriptS20.name(), RASTER];
        let groups: Vec<(&str, Vec<&str>)> = if self.real.is_some() {
            let best = [&[matched][..], &BEST[..]].concat();
            vec![(": published decoders", published.to_vec()), (": best decoders", best)]
        } else {
            vec![("", [&published[..], &BEST[..]].concat())]
        };
        let panel = |(group, decodes): &(&str, Vec<&str>)| {
            let mut series = self.scores(decodes, get);
            series.push(base.clone());
            over_m(&format!("{title}{group}"), y_label, series, claims.to_vec())
        };
        groups.iter().map(panel).collect()
    }

    /// A level that needs no measurement.
    fn level(&self, name: String, decoder: &str, height: f64) -> Series {
        let ends = self.twin.scores.rows.iter().map(|r| as_f64(r.m));
        let (low, high) = ends.fold((f64::INFINITY, 0.0_f64), |(l, h), m| (l.min(m), h.max(m)));
        Series::of_decoder(name, decoder, Stroke::Dotted, vec![(low, height), (high, height)])
    }

    fn empty_image(&self, get: fn(&BaselineRow) -> f64) -> Series {
        let of = |b: &&BaselineRow| b.object == self.common() && b.baseline == "empty";
        let found = self.real.unwrap_or(self.twin).scores.baselines.iter().find(of);
        self.level("an empty image".to_owned(), "empty", found.map_or(f64::NAN, get))
    }

    /// Fig. 3B: classification.
    #[must_use]
    pub(super) fn fig_3b(&self) -> Vec<Chart> {
        let claims = [
            claim("paper: at least 0.80 at M = 13", 13.0, 0.80),
            claim("paper: at least 0.98 at M = 20", 20.0, 0.98),
        ];
        let mut labels = self.twin.skin.learned.classifier.library().labels().to_vec();
        labels.sort_unstable();
        labels.dedup();
        let classes = labels.len().max(1);
        let chance = self.level(format!("chance, 1 in {classes}"), "empty", 1.0 / as_f64(classes));
        let right = "share classified correctly";
        let votes = self.panels("Votes of 20 windows", right, |r| r.class_vote20, &claims, &chance);
        let single = self.panels("Single windows", right, |r| r.class_single, &[], &chance);
        [votes, single].concat()
    }

    /// Fig. 3C: support of the reconstruction.
    #[must_use]
    pub(super) fn fig_3c(&self) -> Vec<Chart> {
        let empty = self.empty_image(|b| b.support);
        let mut support = self.panels(
            "Support accuracy",
            "taxels on the right side",
            |r| r.support,
            &[],
            &empty,
        );
        for chart in &mut support {
            chart.y_range = Some((0.5, 1.01));
        }
        let nothing = self.empty_image(|b| b.iou);
        let iou = self.panels(
            "Intersection over union",
            "IoU of the support",
            |r| r.iou,
            &[],
            &nothing,
        );
        let ranges = STATED.map(|(label, from, to)| StatedRange {
            label: label.to_owned(),
            from,
            to,
        });
        let mut all = [support, iou].concat();
        for chart in &mut all {
            chart.ranges = ranges.to_vec();
        }
        all
    }

    /// Look of a whole skin, where a chart has one curve for each.
    fn skin_curve(whose: &str, points: Vec<(f64, f64)>) -> Series {
        let real = whose.contains("real");
        let (name, style) = if real {
            ("real skin", Style::Real)
        } else {
            ("twin", Style::Twin)
        };
        Series::new(name, style, 0, points)
    }
}

impl BothSkins<'_> {
    /// Fig. 3D: frames a second, acquired and decoded.
    #[must_use]
    fn fig_3d(&self, timings: &[TimingRow]) -> Vec<Chart> {
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
    fn fig_3e(&self) -> Vec<Chart> {
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

/// Numbers of measurements a frame in Fig. 5C, and the hue of each.
const FRAMES: [(usize, u8); 3] = [(25, 1), (50, 0), (100, 3)];
/// Locators in Fig. 6: the published ones, the best, and the middle of the sheet, which needs no measurement.
const LOCATORS: [&str; 4] = ["matched", "script_s5", "blob", "middle"];

impl BothSkins<'_> {
    /// Fig. 5B: what the number of measurements a frame does to the frames of a bounce.
    #[must_use]
    fn fig_5b(&self) -> Vec<Chart> {
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
    fn fig_5c(&self) -> Vec<Chart> {
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
