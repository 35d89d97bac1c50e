//! Counts of one press and what they add up to.

use super::rows::Scores;
use rand::RngExt as _;
use spts_models::Streams;
use spts_recon::classify::VoteScore;
use spts_recon::metrics::{MeanScore, SupportScore};

/// Times presses are drawn anew for a confidence interval.
const RESAMPLES: usize = 1000;

/// What one press contributes to one row.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub(super) supports: Vec<SupportScore>,
    pub(super) single: VoteScore,
    pub(super) voted: VoteScore,
    pub(super) summed: VoteScore,
    pub(super) failed: usize,
}

/// Scores of several presses together.
pub(super) fn pool<'a>(presses: impl Iterator<Item = &'a Tally>) -> Scores {
    let mut mean = MeanScore::default();
    let [mut single, mut voted, mut summed] = [VoteScore::default(); 3];
    for press in presses {
        press.supports.iter().for_each(|s| mean.add(*s));
        single.merge(press.single);
        voted.merge(press.voted);
        summed.merge(press.summed);
    }
    let support = mean.mean().unwrap_or_default();
    Scores {
        support: support.accuracy,
        iou: support.iou,
        f1: support.f1,
        class_single: single.share(),
        class_vote20: voted.share(),
        class_evidence: summed.share(),
    }
}

/// Mean of the scores of several objects. A share that one of them does not have, none has.
pub(super) fn mean(objects: &[Scores]) -> Scores {
    let count = objects.len().max(1) as f64;
    let of = |get: fn(&Scores) -> f64| objects.iter().map(get).sum::<f64>() / count;
    let shares = |get: fn(&Scores) -> Option<f64>| {
        let sum: Option<f64> = objects.iter().map(get).sum();
        sum.map(|s| s / count)
    };
    Scores {
        support: of(|s| s.support),
        iou: of(|s| s.iou),
        f1: of(|s| s.f1),
        class_single: shares(|s| s.class_single),
        class_vote20: shares(|s| s.class_vote20),
        class_evidence: shares(|s| s.class_evidence),
    }
}

/// 95 % intervals of support, IoU and single windows: percentiles of the mean when the presses of every object are drawn anew, with
/// replacement, [`RESAMPLES`] times (B. Efron, R. Tibshirani, *An Introduction to the Bootstrap* (1993), §13.3). Windows of a press
/// resemble each other; presses are what repeats.
pub(super) fn intervals(objects: &[Vec<&Tally>], streams: Streams) -> ([f64; 2], [f64; 2], Option<[f64; 2]>) {
    let mut rng = streams.rng("bootstrap", 0);
    let mut drawn: Vec<Scores> = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let means: Vec<Scores> = objects
            .iter()
            .map(|presses| pool((0..presses.len()).map(|_| presses[rng.random_range(0..presses.len())])))
            .collect();
        drawn.push(mean(&means));
    }
    let of = |get: fn(&Scores) -> f64| percentiles(drawn.iter().map(get).collect());
    let classes: Option<Vec<f64>> = drawn.iter().map(|s| s.class_single).collect();
    (of(|s| s.support), of(|s| s.iou), classes.map(percentiles))
}

fn percentiles(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    [last / 40, last - last / 40].map(|i| values.get(i).copied().unwrap_or_default())
}
