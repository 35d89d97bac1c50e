//! Scores of a press, gathered window by window.

use super::skin::Masks;
use spts_recon::classify::{VoteScore, vote_groups};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};

/// Scores of one press with one decode and M.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Score {
    /// Support accuracy by every truth of [`super::skin::TRUTHS`].
    pub(super) support: [f64; 3],
    /// Intersection over union by every truth.
    pub(super) iou: [f64; 3],
    /// Share of single windows classified correctly.
    pub(super) class_single: f64,
    /// Share of votes classified correctly.
    pub(super) class_vote20: f64,
}

/// Sums over the windows of a press.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    means: [MeanScore; 3],
    single: VoteScore,
    voted: VoteScore,
    mask: Vec<bool>,
}

impl Tally {
    /// Scores an image by every truth.
    pub(super) fn add(&mut self, image: &[f64], masks: &Masks) {
        support(image, SUPPORT_THRESHOLD, &mut self.mask);
        for (mean, truth) in self.means.iter_mut().zip(masks) {
            mean.add(SupportScore::new(&self.mask, truth));
        }
    }

    /// Counts decisions on an object with the label `label`, one by one and in votes of `size`.
    pub(super) fn vote(&mut self, decisions: &[Option<usize>], label: usize, size: usize) {
        self.single.add(decisions, label);
        self.voted.add(&vote_groups(decisions, size, false), label);
    }

    /// The scores; 0 where nothing was counted.
    pub(super) fn score(&self) -> Score {
        let means = self.means.map(|mean| mean.mean());
        Score {
            support: means.map(|mean| mean.map_or(0.0, |s| s.accuracy)),
            iou: means.map(|mean| mean.map_or(0.0, |s| s.iou)),
            class_single: self.single.share().unwrap_or(0.0),
            class_vote20: self.voted.share().unwrap_or(0.0),
        }
    }
}
