//! Scores of a press against each ground truth.

use spts_eval::Tally;

/// Scores of one press with one decode and M.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct PressScores {
    /// Support accuracy against each ground truth in [`super::skin::TRUTHS`].
    pub(super) support: [f64; 3],
    /// Intersection over union against each ground truth.
    pub(super) iou: [f64; 3],
    /// Share of single windows classified correctly.
    pub(super) class_single: f64,
    /// Share of votes classified correctly.
    pub(super) class_vote20: f64,
}

impl PressScores {
    /// Scores of the images by every truth, and of the classes that are counted in the first tally; 0 where nothing was
    /// counted.
    pub(super) fn new(tallies: &[Tally; 3]) -> Self {
        let scores = tallies.each_ref().map(Tally::scores);
        Self {
            support: scores.map(|s| s.support.unwrap_or(0.0)),
            iou: scores.map(|s| s.iou.unwrap_or(0.0)),
            class_single: scores[0].class_single.unwrap_or(0.0),
            class_vote20: scores[0].class_vote20.unwrap_or(0.0),
        }
    }
}
