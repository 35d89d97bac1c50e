//! The numbers at the top of the report.

use super::best::SHOWN;
use super::curves::BothSkins;
use super::dataset::SimulatedData;
use super::results::{MEAN_COMMON, SkinResults};
use super::tables::CorrelationRow;
use super::timing::TimingRow;
use serde::Serialize;
use spts_eval::decoders::PublishedDecode;
use spts_recon::metrics::median;
use spts_studies::per_object::PerObjectReport;

/// Headline figures; `null` where no recordings were given. Means are over all objects of the skin: seventeen for the
/// twin, those with a compressive session for the real skin; `*_common_*` is the twin over the latter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "each name says score, M, decode and skin")]
pub struct Headline {
    /// Simulated skins that the next four figures are over.
    pub per_object_skins: Option<u64>,
    /// Mean over the objects of |twin − real|; the twin's score is a mean over simulated skins.
    pub iou_m20_matched_mean_abs_difference: Option<f64>,
    /// The same of one of the simulated skins in place of the real one.
    pub iou_m20_matched_between_skins: Option<f64>,
    /// Objects whose real score lies outside the band of the simulated skins, separated by spaces.
    pub iou_m20_matched_outside: Option<String>,
    pub iou_m20_nn_lmmse_mean_abs_difference: Option<f64>,
    pub iou_m20_evidence_mean_abs_difference: Option<f64>,
    pub class_single_m20_matched_mean_abs_difference: Option<f64>,
    pub class_single_m20_evidence_mean_abs_difference: Option<f64>,
    pub support_m20_matched_twin: Option<f64>,
    pub support_m20_matched_common_twin: Option<f64>,
    pub support_m20_matched_real: Option<f64>,
    pub support_m20_script_real: Option<f64>,
    pub iou_m20_matched_twin: Option<f64>,
    pub iou_m20_matched_common_twin: Option<f64>,
    pub iou_m20_matched_real: Option<f64>,
    pub class_vote20_m20_matched_twin: Option<f64>,
    pub class_vote20_m20_matched_common_twin: Option<f64>,
    pub class_vote20_m20_matched_real: Option<f64>,
    pub class_vote20_m20_script_real: Option<f64>,
    pub iou_m20_evidence_twin: Option<f64>,
    pub iou_m20_evidence_common_twin: Option<f64>,
    pub iou_m20_evidence_real: Option<f64>,
    pub class_vote20_m20_evidence_twin: Option<f64>,
    pub class_vote20_m20_evidence_common_twin: Option<f64>,
    pub class_vote20_m20_evidence_real: Option<f64>,
    pub class_single_m20_matched_twin: Option<f64>,
    pub class_single_m20_matched_common_twin: Option<f64>,
    pub class_single_m20_matched_real: Option<f64>,
    pub localisation_px_m25_twin: Option<f64>,
    pub localisation_px_m25_real: Option<f64>,
    /// Distance of the middle of the skin from the ball, which takes no measurement.
    pub localisation_px_middle_twin: Option<f64>,
    pub localisation_px_middle_real: Option<f64>,
    /// First bounce of every drop, from the mechanics, mean.
    pub bounce_contact_ms_twin: Option<f64>,
    /// The twin's contacts as its recording shows them, median.
    pub bounce_contact_recorded_ms_twin: Option<f64>,
    /// The real contacts as their recording shows them, median.
    pub bounce_contact_ms_real: Option<f64>,
    /// First bounce of every drop, from the mechanics, mean.
    pub bounce_cor_twin: Option<f64>,
    /// Largest restitution of any bounce.
    pub bounce_cor_max_twin: Option<f64>,
    pub raster_corr_mean: Option<f64>,
    pub raster_corr_min: Option<f64>,
    /// Mean force on the plateau over all presses, N.
    pub press_plateau_n: Option<f64>,
    /// Largest deviation of any press from its target on the plateau, N.
    pub press_plateau_error_max_n: Option<f64>,
    /// Presses that did not reach and hold their target.
    pub presses_off_target: usize,
    /// Largest |Σ p·A − force| / force over all frames of all presses and drops.
    pub force_imbalance_max: f64,
    pub decode_us_m25_median: Option<f64>,
    pub wall_s: f64,
}

/// M of the scores.
const M: usize = 20;
/// M of the localisation and of the decoding time.
const M_FAST: usize = 25;

impl Headline {
    /// Collects the figures.
    #[must_use]
    pub(super) fn new(
        dataset: &SimulatedData,
        skins: &BothSkins<'_>,
        per_object: Option<&PerObjectReport>,
        correlations: &[CorrelationRow],
        timings: &[TimingRow],
        wall_s: f64,
    ) -> Self {
        let (twin, real) = (skins.twin, skins.real);
        let distance = |decoder: &str, score: &str| per_object.and_then(|found| found.distance(decoder, M, score));
        let off = |decoder: &str, score: &str| distance(decoder, score).map(|d| d.mean_abs_difference);
        let matched_iou = distance("matched", "iou");
        let (matched, script) = (PublishedDecode::Matched.name(), PublishedDecode::ScriptS20.name());
        let of_twin = |object: &str| twin.scores.row(object, matched, M);
        let of_real = |decode: &str| real.and_then(|r| r.scores.row("mean", decode, M));
        let of_best = |object: &str| twin.scores.row(object, SHOWN, M);
        let firsts = || dataset.drops.iter().filter_map(|d| d.bounces.first());
        let courses = || dataset.objects.iter().flat_map(|o| o.courses.iter().flatten());
        let r: Vec<f64> = correlations.iter().map(|c| c.pearson_r).collect();
        let presses = dataset.objects.iter().map(|o| o.imbalance);
        let balance = presses.chain(dataset.drops.iter().map(|d| d.imbalance));
        let missed = dataset.objects.iter().flat_map(|o| &o.courses).filter(|c| c.is_none());
        Self {
            per_object_skins: per_object.map(|found| found.skins),
            iou_m20_matched_mean_abs_difference: matched_iou.map(|d| d.mean_abs_difference),
            iou_m20_matched_between_skins: matched_iou.map(|d| d.between_skins),
            iou_m20_matched_outside: matched_iou.map(|d| d.outside.clone()),
            iou_m20_nn_lmmse_mean_abs_difference: off("nn_lmmse", "iou"),
            iou_m20_evidence_mean_abs_difference: off("evidence", "iou"),
            class_single_m20_matched_mean_abs_difference: off("matched", "class_single"),
            class_single_m20_evidence_mean_abs_difference: off("evidence", "class_single"),
            support_m20_matched_twin: of_twin("mean").map(|s| s.support),
            support_m20_matched_common_twin: of_twin(MEAN_COMMON).map(|s| s.support),
            support_m20_matched_real: of_real(matched).map(|s| s.support),
            support_m20_script_real: of_real(script).map(|s| s.support),
            iou_m20_matched_twin: of_twin("mean").map(|s| s.iou),
            iou_m20_matched_common_twin: of_twin(MEAN_COMMON).map(|s| s.iou),
            iou_m20_matched_real: of_real(matched).map(|s| s.iou),
            class_vote20_m20_matched_twin: of_twin("mean").map(|s| s.class_vote20),
            class_vote20_m20_matched_common_twin: of_twin(MEAN_COMMON).map(|s| s.class_vote20),
            class_vote20_m20_matched_real: of_real(matched).map(|s| s.class_vote20),
            class_vote20_m20_script_real: of_real(script).map(|s| s.class_vote20),
            iou_m20_evidence_twin: of_best("mean").map(|s| s.iou),
            iou_m20_evidence_common_twin: of_best(MEAN_COMMON).map(|s| s.iou),
            iou_m20_evidence_real: of_real(SHOWN).map(|s| s.iou),
            class_vote20_m20_evidence_twin: of_best("mean").map(|s| s.class_vote20),
            class_vote20_m20_evidence_common_twin: of_best(MEAN_COMMON).map(|s| s.class_vote20),
            class_vote20_m20_evidence_real: of_real(SHOWN).map(|s| s.class_vote20),
            class_single_m20_matched_twin: of_twin("mean").map(|s| s.class_single),
            class_single_m20_matched_common_twin: of_twin(MEAN_COMMON).map(|s| s.class_single),
            class_single_m20_matched_real: of_real(matched).map(|s| s.class_single),
            localisation_px_m25_twin: twin.scores.located(matched, M_FAST).map(|l| l.mean_px),
            localisation_px_m25_real: real.and_then(|r| r.scores.located(matched, M_FAST)).map(|l| l.mean_px),
            localisation_px_middle_twin: twin.middle_px(M_FAST),
            localisation_px_middle_real: real.and_then(|r| r.middle_px(M_FAST)),
            bounce_contact_ms_twin: mean(firsts().map(|b| b.contact_s * 1e3)),
            bounce_contact_recorded_ms_twin: twin.contact_ms(),
            bounce_contact_ms_real: real.and_then(SkinResults::contact_ms),
            bounce_cor_twin: mean(firsts().map(spts_sim::world::Bounce::restitution)),
            bounce_cor_max_twin: dataset
                .drops
                .iter()
                .flat_map(|d| d.bounces.iter().map(spts_sim::world::Bounce::restitution))
                .reduce(f64::max),
            raster_corr_mean: mean(r.iter().copied()),
            raster_corr_min: r.iter().copied().reduce(f64::min),
            press_plateau_n: mean(courses().map(|c| c.plateau_n)),
            press_plateau_error_max_n: courses().map(|c| c.plateau_error_n).reduce(f64::max),
            presses_off_target: missed.count(),
            force_imbalance_max: balance.fold(0.0, f64::max),
            decode_us_m25_median: median(
                &timings
                    .iter()
                    .filter(|t| t.m == M_FAST)
                    .map(|t| t.decode_us_median)
                    .collect::<Vec<_>>(),
            ),
            wall_s,
        }
    }
}

/// Mean of the finite values, or `None` without one.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    spts_recon::statistics::mean(values.filter(|v| v.is_finite()))
}
