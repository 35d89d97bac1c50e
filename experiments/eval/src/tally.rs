//! Counts of one press, and the resulting scores.

use crate::protocol::mask;
use rand::RngExt as _;
use serde::{Deserialize, Serialize};
use spts_models::Streams;
use spts_recon::classify::{VoteScore, vote_groups};
use spts_recon::metrics::{MeanScore, SupportScore};

/// Times presses are drawn anew for a confidence interval.
const RESAMPLES: usize = 1000;

/// How good the decoded windows of one decoder are: images, and classes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Scores {
    /// Support accuracy: share of taxels correctly above or below 0.23 of the maximum. `None`, like all image scores,
    /// for a decoder that only classifies.
    pub support: Option<f64>,
    /// Intersection over union of the supports.
    pub iou: Option<f64>,
    /// F1 of the supports.
    pub f1: Option<f64>,
    /// Balanced accuracy of the supports; not on the board.
    #[serde(skip)]
    pub balanced_accuracy: Option<f64>,
    /// Share of single windows classified correctly; `None` when the object was left out.
    pub class_single: Option<f64>,
    /// Share of majority votes of 20 windows that are correct.
    pub class_vote20: Option<f64>,
    /// Share of correct votes with a list of decisions that is never cleared within a press, as in the published
    /// script. Not on the board.
    #[serde(skip)]
    pub class_cumulative: Option<f64>,
    /// Share of correct classes after adding up the evidence of 20 windows; `None` without evidence.
    pub class_evidence: Option<f64>,
}

/// A column of scores: its name in files, and the score.
pub(crate) type ScoreColumn<T> = (&'static str, fn(&T) -> Option<f64>);

impl Scores {
    /// Columns in files.
    pub(crate) const COLUMNS: [ScoreColumn<Self>; 6] = [
        ("support", |s| s.support),
        ("iou", |s| s.iou),
        ("f1", |s| s.f1),
        ("class_single", |s| s.class_single),
        ("class_vote20", |s| s.class_vote20),
        ("class_evidence", |s| s.class_evidence),
    ];
}

/// Scores of the windows of one press by one decoder and M.
///
/// ```
/// use spts_eval::Tally;
///
/// let mut tally = Tally::default();
/// tally.image(&[0.0, 2.0, 1.9, 0.1], &[false, true, false, false]);
/// tally.decisions(&[Some(3), Some(5), Some(3), Some(3)], 3, 2);
/// let scores = tally.scores();
/// assert_eq!(scores.iou, Some(0.5));
/// assert_eq!(scores.class_single, Some(0.75));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Tally {
    supports: Vec<SupportScore>,
    /// Whether any window had an image.
    has_images: bool,
    single: VoteScore,
    voted: VoteScore,
    cumulative: VoteScore,
    summed: VoteScore,
    /// Number of windows that the algorithm could not solve.
    pub(crate) failed: usize,
}

impl Tally {
    /// Scores `image` against the true support `truth`. If other windows have an image and this one has none, it counts
    /// as an empty one.
    pub fn image(&mut self, image: &[f64], truth: &[bool]) {
        let mut mask = mask(image);
        mask.resize(truth.len(), false);
        self.supports.push(SupportScore::new(&mask, truth));
        self.has_images |= !image.is_empty();
    }

    /// Counts the classes of consecutive windows, whose correct class is `label`: individually, and in votes of `vote`
    /// decisions.
    pub fn decisions(&mut self, decisions: &[Option<usize>], label: usize, vote: usize) {
        self.single.add(decisions, label);
        self.voted.add(&vote_groups(decisions, vote, false), label);
        self.cumulative.add(&vote_groups(decisions, vote, true), label);
    }

    /// Counts classes by the evidence of many windows.
    pub(crate) fn summed(&mut self, decisions: &[Option<usize>], label: usize) {
        self.summed.add(decisions, label);
    }

    /// The scores of this press.
    pub fn scores(&self) -> Scores {
        pool([self])
    }
}

/// Scores of several presses together.
pub(crate) fn pool<'a>(presses: impl IntoIterator<Item = &'a Tally>) -> Scores {
    let (mut mean, mut has_images) = (MeanScore::default(), false);
    let [mut single, mut voted, mut cumulative, mut summed] = [VoteScore::default(); 4];
    for press in presses {
        press.supports.iter().for_each(|s| mean.add(*s));
        has_images |= press.has_images;
        single.merge(press.single);
        voted.merge(press.voted);
        cumulative.merge(press.cumulative);
        summed.merge(press.summed);
    }
    let support = mean.mean().filter(|_| has_images);
    Scores {
        support: support.map(|s| s.accuracy),
        iou: support.map(|s| s.iou),
        f1: support.map(|s| s.f1),
        balanced_accuracy: support.map(|s| s.balanced_accuracy),
        class_single: single.share(),
        class_vote20: voted.share(),
        class_cumulative: cumulative.share(),
        class_evidence: summed.share(),
    }
}

/// Mean of the scores of several objects. A score that one of them does not have, none has.
pub(crate) fn mean(objects: &[Scores]) -> Scores {
    let count = objects.len().max(1) as f64;
    let of = |get: fn(&Scores) -> Option<f64>| {
        let sum: Option<f64> = objects.iter().map(get).sum();
        sum.map(|s| s / count)
    };
    Scores {
        support: of(|s| s.support),
        iou: of(|s| s.iou),
        f1: of(|s| s.f1),
        balanced_accuracy: of(|s| s.balanced_accuracy),
        class_single: of(|s| s.class_single),
        class_vote20: of(|s| s.class_vote20),
        class_cumulative: of(|s| s.class_cumulative),
        class_evidence: of(|s| s.class_evidence),
    }
}

/// 95 % intervals of support, IoU and single windows, see [`bootstrap`].
pub(crate) fn intervals(objects: &[Vec<Tally>]) -> [Option<[f64; 2]>; 3] {
    bootstrap(objects, |drawn| {
        let means: Vec<Scores> = drawn.iter().map(|presses| pool(presses.iter().copied())).collect();
        let scores = mean(&means);
        [scores.support, scores.iou, scores.class_single]
    })
}

/// 95 % intervals of what `score` makes of the presses of every object: percentiles when the presses of every object
/// are drawn anew, with replacement, [`RESAMPLES`] times (B. Efron, R. Tibshirani, *An Introduction to the Bootstrap*
/// (1993), §13.3). Windows of a press resemble each other; presses are what repeats. A score that is missing once has
/// no interval.
pub(crate) fn bootstrap<T, const K: usize>(
    objects: &[Vec<T>],
    score: impl Fn(&[Vec<&T>]) -> [Option<f64>; K],
) -> [Option<[f64; 2]>; K] {
    let mut rng = Streams::new(1).rng("bootstrap", 0);
    let mut values: [Option<Vec<f64>>; K] = std::array::from_fn(|_| Some(Vec::with_capacity(RESAMPLES)));
    for _ in 0..RESAMPLES {
        let drawn: Vec<Vec<&T>> = objects
            .iter()
            .map(|presses| {
                let count = presses.len();
                (0..count).map(|_| &presses[rng.random_range(0..count)]).collect()
            })
            .collect();
        for (values, score) in values.iter_mut().zip(score(&drawn)) {
            match score {
                Some(score) => values.iter_mut().for_each(|v| v.push(score)),
                None => *values = None,
            }
        }
    }
    values.map(|values| values.map(percentiles))
}

fn percentiles(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    [last / 40, last - last / 40].map(|i| values.get(i).copied().unwrap_or_default())
}

/// `values` without duplicates, in order of first appearance.
///
/// ```
/// assert_eq!(spts_eval::unique([3, 1, 3, 2, 1]), [3, 1, 2]);
/// ```
pub fn unique<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program that says classes alone has no score of images; one that leaves out a single image is scored as if it
    /// saw nothing there.
    #[test]
    fn what_makes_no_image_has_no_score_of_images() {
        let truth = [true, false];
        let mut tally = Tally::default();
        tally.image(&[], &truth);
        tally.decisions(&[Some(3), Some(4)], 3, 2);
        let scores = tally.scores();
        assert_eq!((scores.support, scores.iou, scores.f1), (None, None, None));
        assert_eq!(scores.class_single, Some(0.5));
        tally.image(&[1.0, 0.0], &truth);
        assert_eq!(tally.scores().iou, Some(0.5));
    }
}
