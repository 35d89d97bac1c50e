//! Counts of one press, and the resulting scores.

use crate::protocol::{Truth, mask};
use crate::truth::{PressTruth, TruthKind};
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
    /// Cosine of the angle between the images: a score without a threshold.
    #[serde(default)]
    pub cosine: Option<f64>,
    /// Weighted Jaccard index of the images, both scaled to length 1: Σ min / Σ max over the taxels.
    #[serde(default)]
    pub jaccard: Option<f64>,
    /// Intersection over union that the truth itself reaches ([`PressTruth::ceiling`]).
    #[serde(default)]
    pub ceiling: Option<f64>,
    /// Error of a taxel of a fitted truth, as a share of its largest value ([`PressTruth::error`]).
    #[serde(default)]
    pub truth_error: Option<f64>,
    /// Intersection over union with the support of one raster frame of another press: the score of the publication.
    #[serde(default)]
    pub iou_raster: Option<f64>,
    /// Intersection over union that the image which is fitted to the whole press reaches with that frame.
    #[serde(default)]
    pub ceiling_raster: Option<f64>,
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
    pub(crate) const COLUMNS: [ScoreColumn<Self>; 9] = [
        ("support", |s| s.support),
        ("iou", |s| s.iou),
        ("f1", |s| s.f1),
        ("cosine", |s| s.cosine),
        ("jaccard", |s| s.jaccard),
        ("iou_raster", |s| s.iou_raster),
        ("class_single", |s| s.class_single),
        ("class_vote20", |s| s.class_vote20),
        ("class_evidence", |s| s.class_evidence),
    ];
    /// Columns in files that say how good the truth is, whatever the decoder.
    pub(crate) const TRUTH: [ScoreColumn<Self>; 3] =
        [("ceiling", |s| s.ceiling), ("truth_error", |s| s.truth_error), ("ceiling_raster", |s| s.ceiling_raster)];
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
    /// Cosine, weighted Jaccard index and intersection over union with the raster frame of every image.
    others: [Vec<f64>; 3],
    /// Where the truth comes from.
    pub(crate) kind: Option<TruthKind>,
    /// Ceiling, error and ceiling of the raster frame of the press.
    truth: [Option<f64>; 3],
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
    /// A tally of a press of which `known` is known.
    pub(crate) fn of(known: &PressTruth) -> Self {
        let truth = [known.ceiling, known.error, known.ceiling_raster];
        Self { kind: Some(known.kind), truth, ..Self::default() }
    }

    /// Scores `image` against `truth`, and against the `raster` frame of another press.
    pub(crate) fn image_of(&mut self, image: &[f64], truth: &Truth, raster: Option<&Truth>) {
        self.image(image, &truth.support);
        let [cosines, jaccards, by_raster] = &mut self.others;
        let (cosine, jaccard) = alike(image, &truth.image);
        cosines.push(cosine);
        jaccards.push(jaccard);
        by_raster.extend(raster.map(|raster| support_score(image, &raster.support).iou));
    }

    /// Scores `image` against the true support `truth`. If other windows have an image and this one has none, it counts
    /// as an empty one.
    pub fn image(&mut self, image: &[f64], truth: &[bool]) {
        self.supports.push(support_score(image, truth));
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

/// The support of `image` against the true one; an image that is missing is an empty one.
pub(crate) fn support_score(image: &[f64], truth: &[bool]) -> SupportScore {
    let mut found = mask(image);
    found.resize(truth.len(), false);
    SupportScore::new(&found, truth)
}

/// Cosine and weighted Jaccard index of an image and the true one, both scaled to length 1; 0 for an image without a
/// value above zero.
fn alike(image: &[f64], truth: &[f64]) -> (f64, f64) {
    let positive = |values: &[f64]| values.iter().map(|v| v.max(0.0)).collect::<Vec<f64>>();
    let length = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (mut image, truth) = (positive(image), positive(truth));
    image.resize(truth.len(), 0.0);
    let (own, other) = (length(&image), length(&truth));
    if !(own > 0.0 && other > 0.0 && own.is_finite() && other.is_finite()) {
        return (0.0, 0.0);
    }
    let (mut cosine, mut least, mut most) = (0.0, 0.0, 0.0);
    for (a, b) in image.iter().zip(&truth) {
        let (a, b) = (a / own, b / other);
        cosine += a * b;
        least += a.min(b);
        most += a.max(b);
    }
    (cosine, least / most)
}

/// A mean that is summed up.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1.0;
    }

    fn mean(self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }

    /// The mean of `count` values; `None` if some of them are missing.
    fn mean_of(self, count: f64) -> Option<f64> {
        self.mean().filter(|_| self.count >= count)
    }
}

/// Scores of several presses together.
pub(crate) fn pool<'a>(presses: impl IntoIterator<Item = &'a Tally>) -> Scores {
    let (mut mean, mut has_images) = (MeanScore::default(), false);
    let (mut others, mut truth) = ([Mean::default(); 3], [Mean::default(); 3]);
    let [mut single, mut voted, mut cumulative, mut summed] = [VoteScore::default(); 4];
    let mut count = 0.0;
    for press in presses {
        count += 1.0;
        press.supports.iter().for_each(|s| mean.add(*s));
        has_images |= press.has_images;
        others.iter_mut().zip(&press.others).for_each(|(mean, own)| own.iter().for_each(|v| mean.add(*v)));
        truth.iter_mut().zip(press.truth).for_each(|(mean, own)| own.into_iter().for_each(|v| mean.add(v)));
        single.merge(press.single);
        voted.merge(press.voted);
        cumulative.merge(press.cumulative);
        summed.merge(press.summed);
    }
    let support = mean.mean().filter(|_| has_images);
    let ([cosine, jaccard, by_raster], [ceiling, error, ceiling_raster]) = (others, truth);
    Scores {
        support: support.map(|s| s.accuracy),
        iou: support.map(|s| s.iou),
        f1: support.map(|s| s.f1),
        cosine: cosine.mean().filter(|_| has_images),
        jaccard: jaccard.mean().filter(|_| has_images),
        iou_raster: by_raster.mean().filter(|_| has_images),
        ceiling: ceiling.mean_of(count),
        truth_error: error.mean_of(count),
        ceiling_raster: ceiling_raster.mean_of(count),
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
        cosine: of(|s| s.cosine),
        jaccard: of(|s| s.jaccard),
        ceiling: of(|s| s.ceiling),
        truth_error: of(|s| s.truth_error),
        iou_raster: of(|s| s.iou_raster),
        ceiling_raster: of(|s| s.ceiling_raster),
        balanced_accuracy: of(|s| s.balanced_accuracy),
        class_single: of(|s| s.class_single),
        class_vote20: of(|s| s.class_vote20),
        class_cumulative: of(|s| s.class_cumulative),
        class_evidence: of(|s| s.class_evidence),
    }
}

/// 95 % intervals of support, IoU and single windows, see [`bootstrap`].
pub(crate) fn intervals(sessions: &[Vec<Tally>], objects: &[usize]) -> [Option<[f64; 2]>; 3] {
    bootstrap(sessions, objects, |drawn| {
        let means: Vec<Scores> = drawn.iter().map(|presses| pool(presses.iter().copied())).collect();
        let scores = mean(&means);
        [scores.support, scores.iou, scores.class_single]
    })
}

/// 95 % intervals of what `score` makes of the presses of all sessions, session i being one of the object numbered
/// `objects[i]`: percentiles over [`RESAMPLES`] draws. Each draws as many objects as there are with replacement, then
/// of each of them its sessions, then of each of these its presses (A. Davison, D. Hinkley, *Bootstrap Methods and
/// their Application* (1997), §3.8). With one object, the interval is over its sessions and presses. Windows of a press
/// resemble each other, and so do the presses of an object: what is claimed of objects has to vary them. A score that
/// is missing once has no interval.
pub(crate) fn bootstrap<T, const K: usize>(
    sessions: &[Vec<T>],
    objects: &[usize],
    score: impl Fn(&[Vec<&T>]) -> [Option<f64>; K],
) -> [Option<[f64; 2]>; K] {
    let mut rng = Streams::new(1).rng("bootstrap", 0);
    // sessions without a press have no part in the means
    let there = |i: &usize| sessions.get(*i).is_some_and(|presses| !presses.is_empty());
    let own = |object: usize| (0..objects.len()).filter(move |&i| objects[i] == object).filter(there);
    let all = unique(objects.iter().copied()).into_iter().map(|o| own(o).collect::<Vec<usize>>());
    let all: Vec<Vec<usize>> = all.filter(|sessions| !sessions.is_empty()).collect();
    let mut values: [Option<Vec<f64>>; K] = std::array::from_fn(|_| Some(Vec::with_capacity(RESAMPLES)));
    for _ in 0..RESAMPLES {
        let mut drawn: Vec<Vec<&T>> = Vec::with_capacity(sessions.len());
        for _ in 0..all.len() {
            let own = &all[rng.random_range(0..all.len())];
            for _ in 0..own.len() {
                let presses = &sessions[own[rng.random_range(0..own.len())]];
                drawn.push((0..presses.len()).map(|_| &presses[rng.random_range(0..presses.len())]).collect());
            }
        }
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

    fn mean_of(drawn: &[Vec<&f64>]) -> [Option<f64>; 1] {
        let of = |presses: &Vec<&f64>| presses.iter().copied().sum::<f64>() / presses.len() as f64;
        [Some(drawn.iter().map(of).sum::<f64>() / drawn.len() as f64)]
    }

    /// Ten objects whose presses agree: the interval is that of the mean of ten objects, ±1.96 standard errors of the
    /// population of ten, to a fifth. As ten sessions of one object it is as wide, and over its presses alone it has no
    /// width.
    #[test]
    fn intervals_are_over_objects() {
        let sessions: Vec<Vec<f64>> = (0..10).map(|k| vec![f64::from(k) / 10.0; 6]).collect();
        let objects: Vec<usize> = (0..10).collect();
        let [Some([low, high])] = bootstrap(&sessions, &objects, mean_of) else { panic!("no interval") };
        let expected = 2.0 * 1.96 * (0.0825_f64 / 10.0).sqrt();
        assert!(((high - low) / expected - 1.0).abs() < 0.2, "{low} {high}, expected {expected}");
        let [Some([low, high])] = bootstrap(&sessions, &[0; 10], mean_of) else { panic!("no interval") };
        assert!(((high - low) / expected - 1.0).abs() < 0.2, "{low} {high}, expected {expected}");
        assert_eq!(bootstrap(&sessions[3..4], &[0], mean_of), [Some([0.3, 0.3])]);
        assert_eq!(bootstrap(&[vec![0.2, 0.2]], &[7], |_| [None, Some(1.0)]), [None, Some([1.0, 1.0])]);
    }

    /// An image that is the true one, in other units, one of other taxels, and one beside it by half.
    #[test]
    fn images_are_compared_without_a_threshold() {
        assert_eq!(alike(&[2.0, 0.0], &[1.0, 0.0]), (1.0, 1.0));
        assert_eq!(alike(&[0.0, -1.0], &[1.0, 0.0]), (0.0, 0.0));
        assert_eq!(alike(&[], &[1.0, 0.0]), (0.0, 0.0));
        let (cosine, jaccard) = alike(&[1.0, 1.0], &[1.0, 0.0]);
        let half = 0.5_f64.sqrt();
        assert!((cosine - half).abs() < 1e-12 && (jaccard - half / (1.0 + half)).abs() < 1e-12);
    }

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
