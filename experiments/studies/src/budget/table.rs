//! Rows of the budget, and end points.

use super::estimate::{MeanWithError, ScoreTable, change, level};
use super::score::PressScores;
use super::skin::TRUTHS;
use super::variants::{EVERYTHING, IDEAL, Variants};
use serde::Serialize;
use spts_eval::RASTER;
use spts_eval::decoders::PublishedDecode;

/// Cost of one effect with one decoding variant and M: scores of the modified chain minus those of the reference chain,
/// each with its standard error over the presses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BudgetRow {
    /// Stage: contact, transducer, faults, drive, amplifier, noise or converter.
    pub stage: &'static str,
    /// Effect; `whole_stage` for all effects of the stage together; `layer` for another contact model.
    pub effect: &'static str,
    /// "ablation": the whole chain without the effect, compared with the whole chain; "addition": the ideal chain with
    /// the effect, compared with the ideal chain.
    pub mode: &'static str,
    /// Decoding variant.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Number of taxels, N.
    pub taxels: usize,
    /// Number of sessions S. The standard errors have S − 1 degrees of freedom.
    pub sessions: usize,
    /// Change of the support accuracy.
    pub support_delta: f64,
    /// Its standard error.
    pub support_se: f64,
    /// Change of the intersection over union.
    pub iou_delta: f64,
    /// Its standard error.
    pub iou_se: f64,
    /// Change of the share of single windows classified correctly.
    pub class_single_delta: f64,
    /// Its standard error.
    pub class_single_se: f64,
    /// Change of the share of votes of 20 windows classified correctly.
    pub class_vote20_delta: f64,
    /// Its standard error.
    pub class_vote20_se: f64,
    /// Change of the intersection over union with the image of a skin that has only the static law, at the same
    /// instant. The transducer cannot change this ground truth.
    pub iou_contact_delta: f64,
    /// Its standard error.
    pub iou_contact_se: f64,
}

/// Reads the change of a score, with its standard error, from a row.
pub type Change = fn(&BudgetRow) -> MeanWithError;

impl BudgetRow {
    /// Change of the intersection over union with the published ground truth.
    #[must_use]
    pub fn iou(&self) -> MeanWithError {
        self.change(self.iou_delta, self.iou_se)
    }

    /// Change of the intersection over union with the ground truth of the contact alone.
    #[must_use]
    pub fn iou_contact(&self) -> MeanWithError {
        self.change(self.iou_contact_delta, self.iou_contact_se)
    }

    /// The change `mean` of one of the row's scores, with its standard error.
    pub(super) fn change(&self, mean: f64, se: f64) -> MeanWithError {
        MeanWithError {
            mean,
            se,
            sessions: self.sessions,
        }
    }
}

/// Scores of a chain that the effects are compared with, such as the ideal one, against one ground truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EndPoint {
    /// "everything", "ideal", or "scan" for the raster frames to which the ground truth belongs.
    pub chain: &'static str,
    /// Decoding variant; "raster" for the scan.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Number of taxels, N.
    pub taxels: usize,
    /// Ground truth: "raster" is the scan's own frame, as in the publication; "image" the noiseless image of the same
    /// skin at that instant; "contact" that of a skin with only the static law.
    pub truth: &'static str,
    /// Support accuracy.
    pub support: f64,
    /// Its standard error.
    pub support_se: Option<f64>,
    /// Intersection over union.
    pub iou: f64,
    /// Its standard error.
    pub iou_se: Option<f64>,
    /// Share of single windows classified correctly.
    pub class_single: f64,
    /// Its standard error.
    pub class_single_se: Option<f64>,
    /// Share of votes of 20 windows classified correctly; none for the scan.
    pub class_vote20: Option<f64>,
    /// Its standard error.
    pub class_vote20_se: Option<f64>,
}

/// Place of the published truth in [`TRUTHS`].
const PUBLISHED: usize = 0;
/// Place of the contact alone in [`TRUTHS`].
const CONTACT_TRUTH: usize = 2;

/// Every comparison with every decode and M, in the order of `variants`.
pub(super) fn rows(
    variants: &Variants,
    scores: &[ScoreTable],
    keys: &[(PublishedDecode, usize)],
    taxels: usize,
) -> Vec<BudgetRow> {
    let mut rows = Vec::new();
    for line in &variants.comparisons {
        let (after, before) = (&scores[line.variant], &scores[line.reference]);
        for (key, &(decode, m)) in keys.iter().enumerate() {
            let of = |get: fn(&PressScores) -> f64| change(after, before, key, get);
            let support = of(|s| s.support[PUBLISHED]);
            let iou = of(|s| s.iou[PUBLISHED]);
            let (single, vote20) = (of(|s| s.class_single), of(|s| s.class_vote20));
            let iou_contact = of(|s| s.iou[CONTACT_TRUTH]);
            rows.push(BudgetRow {
                stage: line.stage,
                effect: line.effect,
                mode: line.mode.name(),
                decode: decode.name(),
                m,
                taxels,
                sessions: support.sessions,
                support_delta: support.mean,
                support_se: support.se,
                iou_delta: iou.mean,
                iou_se: iou.se,
                class_single_delta: single.mean,
                class_single_se: single.se,
                class_vote20_delta: vote20.mean,
                class_vote20_se: vote20.se,
                iou_contact_delta: iou_contact.mean,
                iou_contact_se: iou_contact.se,
            });
        }
    }
    rows
}

/// The two ends by every truth.
pub(super) fn end_points(scores: &[ScoreTable], keys: &[(PublishedDecode, usize)], taxels: usize) -> Vec<EndPoint> {
    let mut points = Vec::new();
    for (chain, index) in [("everything", EVERYTHING), ("ideal", IDEAL)] {
        for (key, &(decode, m)) in keys.iter().enumerate() {
            for truth in 0..TRUTHS.len() {
                let point = EndPoint::new(chain, (decode.name(), m), truth, &scores[index], key);
                points.push(EndPoint { taxels, ..point });
            }
        }
    }
    points
}

/// The scan with the scores `scores` by every truth: what a truth taken from it can be worth. It is one press: how much
/// another would differ is not known, and nothing votes.
pub(super) fn scan(scores: &ScoreTable, taxels: usize) -> Vec<EndPoint> {
    let of_truth = |truth| EndPoint {
        taxels,
        support_se: None,
        iou_se: None,
        class_single_se: None,
        class_vote20: None,
        class_vote20_se: None,
        ..EndPoint::new("scan", (RASTER, taxels), truth, scores, 0)
    };
    (0..TRUTHS.len()).map(of_truth).collect()
}

impl EndPoint {
    fn new(
        chain: &'static str,
        (decode, m): (&'static str, usize),
        truth: usize,
        scores: &ScoreTable,
        key: usize,
    ) -> Self {
        let support = level(scores, key, |s| s.support[truth]);
        let iou = level(scores, key, |s| s.iou[truth]);
        let (single, vote20) = (
            level(scores, key, |s| s.class_single),
            level(scores, key, |s| s.class_vote20),
        );
        Self {
            chain,
            decode,
            m,
            taxels: 0,
            truth: TRUTHS[truth],
            support: support.mean,
            support_se: Some(support.se),
            iou: iou.mean,
            iou_se: Some(iou.se),
            class_single: single.mean,
            class_single_se: Some(single.se),
            class_vote20: Some(vote20.mean),
            class_vote20_se: Some(vote20.se),
        }
    }
}
