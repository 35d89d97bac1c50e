//! The report's line charts: Figs. 3B–3E, 5B, 5C and 6.

use super::latency::LatencyRow;
use super::results::{MEAN_COMMON, SkinResults};
use super::timing::TimingRow;
use crate::figures::{Chart, Claim, Series, Style};
use spts_eval::decoders::PublishedDecode;
use spts_eval::place::locator_label;
use spts_eval::{BaselineRow, ScoreRow};

/// Both skins; the real one only when recordings were given.
pub(super) struct BothSkins<'a> {
    /// The twin.
    pub(super) twin: &'a SkinResults,
    /// The real skin.
    pub(super) real: Option<&'a SkinResults>,
}

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

/// A claim about M or time alone.
fn claim_at(label: &str, x: f64) -> Claim {
    Claim {
        label: label.to_owned(),
        x: Some(x),
        y: None,
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
    /// Objects that the curves are means over: those both skins recorded compressively, or all of the twin's.
    pub(super) fn common(&self) -> &'static str {
        if self.real.is_some() { MEAN_COMMON } else { "mean" }
    }

    /// Series of one score. Every curve is a mean over the objects of [`BothSkins::common`]; beside it, the twin's over
    /// all.
    fn scores(&self, get: fn(&ScoreRow) -> f64) -> Vec<Series> {
        let matched = PublishedDecode::Matched.name();
        let mean = |results: &SkinResults, decode: &str| board(results, self.common(), decode, get);
        let mut all = vec![Series::new("twin, matched", Style::Twin, 0, mean(self.twin, matched))];
        all.push(Series::new(
            "twin, published script",
            Style::Twin,
            2,
            mean(self.twin, PublishedDecode::ScriptS20.name()),
        ));
        if let Some(real) = self.real {
            let everything = board(self.twin, "mean", matched, get);
            all.push(Series::new("twin, matched, all 17 objects", Style::Twin, 1, everything));
            all.push(Series::new("real, matched", Style::Real, 0, mean(real, matched)));
            all.push(Series::new(
                "real, published script",
                Style::Real,
                1,
                mean(real, PublishedDecode::ScriptS20.name()),
            ));
            all.push(Series::new(
                "real raster, down-sampled",
                Style::RasterReal,
                0,
                mean(real, "raster"),
            ));
        }
        all.push(Series::new(
            "twin raster, down-sampled",
            Style::Raster,
            0,
            mean(self.twin, "raster"),
        ));
        all
    }

    fn baseline(&self, name: &str, get: fn(&BaselineRow) -> f64) -> Series {
        let of = |b: &&BaselineRow| b.object == self.common() && b.baseline == "empty";
        let found = self.real.unwrap_or(self.twin).scores.baselines.iter().find(of);
        let ends = self.twin.scores.rows.iter().map(|r| as_f64(r.m));
        let (low, high) = ends.fold((f64::INFINITY, 0.0_f64), |(l, h), m| (l.min(m), h.max(m)));
        let points = found.map_or_else(Vec::new, |b| vec![(low, get(b)), (high, get(b))]);
        Series::new(name, Style::Baseline, 0, points)
    }

    /// Fig. 3B: classification.
    #[must_use]
    pub(super) fn fig_3b(&self) -> Vec<Chart> {
        let claims = || vec![claim("paper: 0.80", 13.0, 0.80), claim("paper: 0.98", 20.0, 0.98)];
        vec![
            over_m(
                "Votes of 20 windows",
                "classified correctly",
                self.scores(|r| r.class_vote20),
                claims(),
            ),
            over_m(
                "Single windows",
                "classified correctly",
                self.scores(|r| r.class_single),
                vec![],
            ),
        ]
    }

    /// Fig. 3C: support of the reconstruction.
    #[must_use]
    pub(super) fn fig_3c(&self) -> Vec<Chart> {
        let mut support = self.scores(|r| r.support);
        support.push(self.baseline("empty image", |b| b.support));
        let claims = vec![
            claim_at("paper: small objects, 15–20", 20.0),
            claim_at("paper: large ones, 25–30", 30.0),
        ];
        let mut accuracy = over_m("Support accuracy", "taxels on the right side", support, claims);
        accuracy.y_range = Some((0.5, 1.01));
        vec![
            accuracy,
            over_m(
                "Intersection over union",
                "IoU of the support",
                self.scores(|r| r.iou),
                vec![],
            ),
        ]
    }

    /// Fig. 3D: frames a second, acquired and decoded.
    #[must_use]
    pub(super) fn fig_3d(&self, timings: &[TimingRow]) -> Vec<Chart> {
        let khz = |rate_hz: f64| {
            timings
                .iter()
                .map(|t| (as_f64(t.m), rate_hz / as_f64(t.m) * 1e-3))
                .collect()
        };
        let mut all = Vec::new();
        if let Some(raster) = self.twin.skin.sessions.first().and_then(|s| s.raster.as_ref()) {
            all.push(Series::new(
                "acquired, twin and real (64.3 kHz)",
                Style::Twin,
                0,
                khz(raster.sample_rate_hz()),
            ));
        }
        let decoded = timings
            .iter()
            .map(|t| (as_f64(t.m), 1e3 / t.decode_us_median))
            .collect();
        all.push(Series::new(
            "decoded, one thread of this machine",
            Style::Baseline,
            0,
            decoded,
        ));
        all.push(Series::new("paper: acquired (70 kHz)", Style::Paper, 0, khz(70e3)));
        vec![Chart {
            y_log: true,
            y_range: None,
            ..over_m(
                "Frame rate",
                "frames a second, thousands",
                all,
                vec![
                    claim("paper: 3500 at 20", 20.0, 3.5),
                    claim("paper: 5400 at 13", 13.0, 5.4),
                ],
            )
        }]
    }

    /// Fig. 3E: classification over time.
    #[must_use]
    pub(super) fn fig_3e(&self) -> Vec<Chart> {
        let panel = |title: &str, x_label: &str, rule: &'static str, measurements: &[usize], claims| Chart {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            x_log: false,
            claims,
            ..over_m("", "classified correctly", self.latencies(rule, measurements), vec![])
        };
        vec![
            panel(
                "From 100 frames after contact (published rule)",
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
        let mut add = |name: &str, kind: Style, raster: Style, results: &SkinResults| {
            for (variant, &m) in (0_u8..).zip(measurements) {
                let points = curve(&results.latency, PublishedDecode::Matched.name(), m);
                all.push(Series::new(format!("{name}, M = {m}"), kind, variant, points));
            }
            let points = curve(&results.latency, "raster", 100);
            if !points.is_empty() {
                all.push(Series::new(format!("{name}, raster"), raster, 0, points));
            }
        };
        add("twin", Style::Twin, Style::Raster, self.twin);
        if let Some(real) = self.real {
            add("real", Style::Real, Style::RasterReal, real);
        }
        all
    }

    /// Figs. 5B and 5C: a bounce at several frame rates.
    #[must_use]
    pub(super) fn fig_5(&self) -> (Vec<Chart>, Vec<Chart>) {
        let mut change = Vec::new();
        let mut frames = Vec::new();
        let mut peaks = Vec::new();
        let all = [Some(self.twin), self.real];
        let shown = all.iter().flatten().flat_map(|r| &r.traces).filter(|t| t.bounce == 0);
        let highest_v = shown.map(|t| t.peak_v).fold(0.0, f64::max);
        let mut add = |name: &str, kind: Style, results: &SkinResults| {
            let of = |get: fn(&super::tracking::TrackingRow) -> f64| {
                results.tracking.iter().map(|t| (as_f64(t.m), get(t))).collect()
            };
            change.push(Series::new(name, kind, 0, of(|t| t.mean_change_v)));
            frames.push(Series::new(name, kind, 0, of(|t| t.frames_in_contact)));
            let traces = [25, 50, 100].iter().zip(0_u8..).map(|(&m, variant)| {
                let of = results.traces.iter().filter(|t| t.bounce == 0 && t.m == m);
                Series::new(
                    format!("M = {m}"),
                    kind,
                    variant,
                    of.map(|t| (t.time_ms, t.peak_v)).collect(),
                )
            });
            peaks.push(Chart {
                title: format!("First recorded bounce, {name}"),
                x_label: "ms since first contact".to_owned(),
                y_label: "largest taxel, V".to_owned(),
                x_log: false,
                y_range: Some((0.0, 1.05 * highest_v)),
                ..over_m("", "", traces.collect(), vec![claim_at("paper: about 8 ms", 8.0)])
            });
        };
        add("twin", Style::Twin, self.twin);
        if let Some(real) = self.real {
            add("real", Style::Real, real);
        }
        let linear = |title: &str, y_label: &str, series: Vec<Series>, claims| Chart {
            x_log: false,
            y_range: None,
            ..over_m(title, y_label, series, claims)
        };
        let b = vec![
            linear(
                "Change from frame to frame",
                "mean |Δ| of the largest taxel, V",
                change,
                vec![],
            ),
            linear(
                "Frames in one contact",
                "frames",
                frames,
                vec![claim("paper: 23 at M = 25", 25.0, 23.0)],
            ),
        ];
        (b, peaks)
    }

    /// Fig. 6: localisation.
    #[must_use]
    pub(super) fn fig_6(&self) -> Vec<Chart> {
        let mut all = Vec::new();
        let mut add = |name: &str, kind: Style, results: &SkinResults| {
            for (variant, decode) in [(0, "matched"), (1, "script_s5")] {
                let rows = results.scores.localisation.iter().filter(|r| r.decode == decode);
                let points = rows.map(|r| (as_f64(r.m), r.mean_px)).collect();
                all.push(Series::new(
                    format!("{name}, {}", locator_label(decode)),
                    kind,
                    variant,
                    points,
                ));
            }
        };
        add("twin", Style::Twin, self.twin);
        if let Some(real) = self.real {
            add("real", Style::Real, real);
        }
        let claims = vec![claim("paper: 2 at 7", 7.0, 2.0), claim("paper: 1 at 25", 25.0, 1.0)];
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
