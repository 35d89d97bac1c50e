//! The most important numbers of a report: every one by its key, which the cards of the page show.

use super::dataset::SimulatedData;
use super::results::{BothSkins, MEAN_COMMON, SHOWN, SkinResults, TimingRow};
use super::tables::CorrelationRow;
use serde::{Serialize, Serializer};
use spts_eval::{Cell, ScoreRow};
use spts_recon::metrics::median;
use spts_recon::statistics;
use spts_sim::world::Bounce;
use spts_studies::per_object::{PerObjectReport, ScoreDistance};

/// What the numbers are taken from.
pub(super) struct Facts<'a> {
    pub(super) dataset: &'a SimulatedData,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) per_object: Option<&'a PerObjectReport>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) timings: &'a [TimingRow],
    pub(super) wall_s: f64,
}

/// M of the scores.
const M: usize = 20;
/// M of the localisation and of the decoding time.
const M_FAST: usize = 25;
const MATCHED: &str = "matched";
const SCRIPT: &str = "script_s20";

impl Facts<'_> {
    /// Scores of the twin at M = 20, means over `object`.
    fn twin(&self, decode: &str, object: &str) -> Option<&ScoreRow> {
        self.skins.twin.scores.row(object, decode, M)
    }

    /// Scores of the real skin at M = 20, means over its objects.
    fn real(&self, decode: &str) -> Option<&ScoreRow> {
        self.skins.real.and_then(|real| real.scores.row("mean", decode, M))
    }

    /// How far the twin is from the real skin, object by object, at M = 20.
    fn distance(&self, decode: &str, score: &str) -> Option<&ScoreDistance> {
        self.per_object.and_then(|found| found.distance(decode, M, score))
    }

    fn located(skin: Option<&SkinResults>) -> Option<f64> {
        skin.and_then(|skin| skin.scores.located(MATCHED, M_FAST)).map(|l| l.mean_px)
    }

    /// First bounce of every drop, from the mechanics.
    fn firsts(&self) -> impl Iterator<Item = &Bounce> {
        self.dataset.drops.iter().filter_map(|d| d.bounces.first())
    }

    /// Courses of the presses that held their target: plateau and its largest deviation, N.
    fn plateaus_n(&self) -> impl Iterator<Item = (f64, f64)> {
        let courses = self.dataset.objects.iter().flat_map(|o| o.courses.iter().flatten());
        courses.map(|c| (c.plateau_n, c.plateau_error_n))
    }

    fn pearson_r(&self) -> impl Iterator<Item = f64> {
        self.correlations.iter().map(|c| c.pearson_r)
    }
}

/// A number of the headline: its key, and where it is found.
type Entry = (&'static str, fn(&Facts<'_>) -> Cell);

/// Every number of the headline. Each key says score, M, decoder and skin. Means are over all objects of the skin:
/// seventeen for the twin, those with a compressive session for the real skin; `*_common_*` is the twin over the
/// latter. The first seven but one are means over the objects of |twin − real|, where the twin's score is a mean over
/// `per_object_skins` simulated skins, and `*_between_skins` is the same of one of the simulated skins in place of the
/// real one.
#[rustfmt::skip] // one line a number
const HEADLINE: &[Entry] = &[
    ("per_object_skins", |f| f.per_object.map(|found| found.skins).into()),
    ("iou_m20_matched_mean_abs_difference", |f| f.distance(MATCHED, "iou").map(|d| d.mean_abs_difference).into()),
    ("iou_m20_matched_between_skins", |f| f.distance(MATCHED, "iou").map(|d| d.between_skins).into()),
    // objects whose real score lies outside the band of the simulated skins, separated by spaces
    ("iou_m20_matched_outside", |f| f.distance(MATCHED, "iou").map(|d| d.outside.clone()).into()),
    ("iou_m20_nn_lmmse_mean_abs_difference", |f| {
        f.distance("nn_lmmse", "iou").map(|d| d.mean_abs_difference).into()
    }),
    ("iou_m20_evidence_mean_abs_difference", |f| f.distance(SHOWN, "iou").map(|d| d.mean_abs_difference).into()),
    ("class_single_m20_matched_mean_abs_difference", |f| {
        f.distance(MATCHED, "class_single").map(|d| d.mean_abs_difference).into()
    }),
    ("class_single_m20_evidence_mean_abs_difference", |f| {
        f.distance(SHOWN, "class_single").map(|d| d.mean_abs_difference).into()
    }),
    ("support_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.support).into()),
    ("support_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.support).into()),
    ("support_m20_matched_real", |f| f.real(MATCHED).map(|s| s.support).into()),
    ("support_m20_script_real", |f| f.real(SCRIPT).map(|s| s.support).into()),
    ("iou_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.iou).into()),
    ("iou_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.iou).into()),
    ("iou_m20_matched_real", |f| f.real(MATCHED).map(|s| s.iou).into()),
    ("class_vote20_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.class_vote20).into()),
    ("class_vote20_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_matched_real", |f| f.real(MATCHED).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_script_real", |f| f.real(SCRIPT).map(|s| s.class_vote20).into()),
    ("iou_m20_evidence_twin", |f| f.twin(SHOWN, "mean").map(|s| s.iou).into()),
    ("iou_m20_evidence_common_twin", |f| f.twin(SHOWN, MEAN_COMMON).map(|s| s.iou).into()),
    ("iou_m20_evidence_real", |f| f.real(SHOWN).map(|s| s.iou).into()),
    ("class_vote20_m20_evidence_twin", |f| f.twin(SHOWN, "mean").map(|s| s.class_vote20).into()),
    ("class_vote20_m20_evidence_common_twin", |f| f.twin(SHOWN, MEAN_COMMON).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_evidence_real", |f| f.real(SHOWN).map(|s| s.class_vote20).into()),
    ("class_single_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.class_single).into()),
    ("class_single_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.class_single).into()),
    ("class_single_m20_matched_real", |f| f.real(MATCHED).map(|s| s.class_single).into()),
    ("localisation_px_m25_twin", |f| Facts::located(Some(f.skins.twin)).into()),
    ("localisation_px_m25_real", |f| Facts::located(f.skins.real).into()),
    // distance of the middle of the skin from the ball, which takes no measurement
    ("localisation_px_middle_twin", |f| f.skins.twin.middle_px(M_FAST).into()),
    ("localisation_px_middle_real", |f| f.skins.real.and_then(|r| r.middle_px(M_FAST)).into()),
    ("bounce_contact_ms_twin", |f| mean(f.firsts().map(|b| b.contact_s * 1e3)).into()),
    // contacts as a recording shows them, median
    ("bounce_contact_recorded_ms_twin", |f| f.skins.twin.contact_ms().into()),
    ("bounce_contact_ms_real", |f| f.skins.real.and_then(SkinResults::contact_ms).into()),
    ("bounce_cor_twin", |f| mean(f.firsts().map(Bounce::restitution)).into()),
    ("bounce_cor_max_twin", |f| {
        let all = f.dataset.drops.iter().flat_map(|d| &d.bounces);
        all.map(Bounce::restitution).reduce(f64::max).into()
    }),
    ("raster_corr_mean", |f| mean(f.pearson_r()).into()),
    ("raster_corr_min", |f| f.pearson_r().reduce(f64::min).into()),
    ("press_plateau_n", |f| mean(f.plateaus_n().map(|(n, _)| n)).into()),
    ("press_plateau_error_max_n", |f| f.plateaus_n().map(|(_, error_n)| error_n).reduce(f64::max).into()),
    ("presses_off_target", |f| {
        let courses = f.dataset.objects.iter().flat_map(|o| &o.courses);
        courses.filter(|c| c.is_none()).count().into()
    }),
    // largest |Σ p·A − force| / force over all frames of all presses and drops
    ("force_imbalance_max", |f| {
        let presses = f.dataset.objects.iter().map(|o| o.imbalance);
        presses.chain(f.dataset.drops.iter().map(|d| d.imbalance)).fold(0.0, f64::max).into()
    }),
    ("decode_us_m25_median", |f| {
        let times = f.timings.iter().filter(|t| t.m == M_FAST).map(|t| t.decode_us_median);
        median(&times.collect::<Vec<_>>()).into()
    }),
    ("wall_s", |f| f.wall_s.into()),
];

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    statistics::mean(values.filter(|v| v.is_finite()))
}

/// The most important numbers of a report by their keys; `null` in JSON where there is none, as without recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Headline(Vec<(&'static str, Cell)>);

impl Headline {
    pub(super) fn new(facts: &Facts<'_>) -> Self {
        Self(HEADLINE.iter().map(|(key, value)| (*key, value(facts))).collect())
    }

    fn cell(&self, key: &str) -> Option<&Cell> {
        let found = self.0.iter().find(|(known, _)| *known == key);
        debug_assert!(found.is_some(), "no number is called {key}");
        found.map(|(_, cell)| cell)
    }

    /// The number called `key`.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.cell(key)? {
            Cell::Number(value) => Some(*value),
            Cell::Whole(value) => Some(*value as f64),
            _ => None,
        }
    }

    /// The first number that there is.
    pub fn first(&self, keys: &[impl AsRef<str>]) -> Option<f64> {
        keys.iter().find_map(|key| self.number(key.as_ref()))
    }

    /// Every number is `value`.
    #[cfg(test)]
    pub(super) fn of(value: f64) -> Self {
        Self(HEADLINE.iter().map(|(key, _)| (*key, Cell::Number(value))).collect())
    }

    pub(super) fn words(&self, key: &str) -> &str {
        match self.cell(key) {
            Some(Cell::Text(words)) => words,
            _ => "",
        }
    }
}

impl Serialize for Headline {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, cell)| (key, cell)))
    }
}
