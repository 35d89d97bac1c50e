//! Baselines: images that use no measurement.

use crate::session::ScoredSession;
use crate::training::Learned;
use serde::Serialize;
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};

/// Scores that an image without any measurement gets on one object: a decoder has to be better.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineRow {
    /// Object, or "mean".
    pub object: String,
    /// "empty" or "`mean_image`".
    pub baseline: &'static str,
    /// Support accuracy.
    pub support: f64,
    /// Intersection over union.
    pub iou: f64,
    /// F1.
    pub f1: f64,
    /// Balanced accuracy.
    pub balanced_accuracy: f64,
}

/// Scores of trivial baselines: an empty image, and the mean of all library images.
#[must_use]
pub fn baselines(sessions: &[ScoredSession], learned: &Learned) -> Vec<BaselineRow> {
    let library = learned.classifier.library();
    let mut mean_image = vec![0.0; library.images().nrows()];
    for (r, v) in mean_image.iter_mut().enumerate() {
        *v = library.images().row(r).iter().sum();
    }
    let mut masks = [("empty", vec![false; mean_image.len()]), ("mean_image", Vec::new())];
    support(&mean_image, SUPPORT_THRESHOLD, &mut masks[1].1);
    let mut rows: Vec<BaselineRow> = Vec::new();
    for (baseline, mask) in &masks {
        let mut mean = MeanScore::default();
        let row = |object: &str, s: SupportScore| BaselineRow {
            object: object.to_owned(),
            baseline,
            support: s.accuracy,
            iou: s.iou,
            f1: s.f1,
            balanced_accuracy: s.balanced_accuracy,
        };
        for (session, truth) in sessions.iter().filter_map(|s| Some((s, s.truth(0)?))) {
            let score = SupportScore::new(mask, &truth.support);
            mean.add(score);
            rows.push(row(session.title(), score));
        }
        if let Some(score) = mean.mean() {
            rows.push(row("mean", score));
        }
    }
    rows
}
