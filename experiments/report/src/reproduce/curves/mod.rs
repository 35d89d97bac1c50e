//! The report's line charts: classification and reconstruction (Figs. 3B, 3C) here, speed (3D, 3E) and the bouncing
//! ball (5B, 5C, 6) in files of their own.

mod ball;
mod speed;

use super::best::BEST;
use super::results::{MEAN_COMMON, SkinResults};
use crate::figures::{Chart, Claim, Series, StatedRange, Stroke, Style};
use spts_eval::decoders::{PublishedDecode, label};
use spts_eval::{BaselineRow, RASTER, ScoreRow};

/// Both skins; the real one only when recordings were given.
pub(super) struct BothSkins<'a> {
    /// The twin.
    pub(super) twin: &'a SkinResults,
    /// The real skin.
    pub(super) real: Option<&'a SkinResults>,
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
    /// Objects that the curves are means over: those both skins recorded compressively, or all of the twin's.
    pub(super) fn common(&self) -> &'static str {
        if self.real.is_some() { MEAN_COMMON } else { "mean" }
    }

    /// The skins with the ending of their names in a legend and the stroke of their curves. Without recordings there is
    /// one, and it needs no name.
    fn named(&self) -> Vec<(&SkinResults, &'static str, Stroke)> {
        match self.real {
            None => vec![(self.twin, "", Stroke::Solid)],
            Some(real) => vec![
                (self.twin, ", twin", Stroke::Solid),
                (real, ", real skin", Stroke::Dashed),
            ],
        }
    }

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
