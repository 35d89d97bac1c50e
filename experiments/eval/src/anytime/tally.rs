//! Where the windows of a press were stopped, and the resulting scores.

use crate::tally::bootstrap;
use serde::{Deserialize, Serialize};
use spts_models::Streams;
use spts_recon::statistics;

/// How one window ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WindowStop {
    /// Number of samples.
    pub(super) samples: usize,
    /// Whether the wanted confidence was reached.
    pub(super) reached: bool,
    /// Confidence at the end.
    pub(super) stated: f64,
    /// For a class 1 if right and 0 if wrong; for an image the intersection over union.
    pub(super) attained: f64,
}

/// How the windows of one press ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PressStops {
    pub(super) windows: Vec<WindowStop>,
    /// Number of windows that the algorithm could not process.
    pub(crate) failed: usize,
}

/// How many samples a decoder took until it stopped, and how good its answers were.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StopScores {
    /// Mean number of samples. A window that never reached the wanted confidence counts with all of its samples.
    /// `None`, like all scores, without windows.
    pub samples: Option<f64>,
    /// Median number of samples.
    pub samples_median: Option<f64>,
    /// Number of samples that is sufficient for 90 % of the windows.
    pub samples_p90: Option<f64>,
    /// Score over all windows: share of right classes, or mean intersection over union.
    pub attained: Option<f64>,
    /// Score over the windows that reached the wanted confidence; `None` if none did.
    pub attained_reached: Option<f64>,
    /// Mean final confidence of the windows that reached the wanted one. For a calibrated decoder it equals
    /// `attained_reached`.
    pub stated: Option<f64>,
    /// Share of windows that never reached the wanted confidence.
    pub never: Option<f64>,
}

impl PressStops {
    /// Number of windows.
    pub(crate) fn len(&self) -> usize {
        self.windows.len()
    }
}

/// Scores of several presses together.
pub(crate) fn pool<'a>(presses: impl IntoIterator<Item = &'a PressStops>) -> StopScores {
    let windows: Vec<&WindowStop> = presses.into_iter().flat_map(|press| &press.windows).collect();
    let mut samples: Vec<usize> = windows.iter().map(|w| w.samples).collect();
    samples.sort_unstable();
    let of = |kept: &dyn Fn(&WindowStop) -> bool, value: fn(&WindowStop) -> f64| {
        let (mut sum, mut count) = (0.0, 0.0);
        for window in windows.iter().filter(|w| kept(w)) {
            sum += value(window);
            count += 1.0;
        }
        (count > 0.0).then(|| sum / count)
    };
    StopScores {
        samples: of(&|_| true, |w| w.samples as f64),
        samples_median: quantile(&samples, 1, 2),
        samples_p90: quantile(&samples, 9, 10),
        attained: of(&|_| true, |w| w.attained),
        attained_reached: of(&|w| w.reached, |w| w.attained),
        stated: of(&|w| w.reached, |w| w.stated),
        never: of(&|_| true, |w| if w.reached { 0.0 } else { 1.0 }),
    }
}

/// The least of the `sorted` values that `share`/`of` of them do not exceed.
fn quantile(sorted: &[usize], share: usize, of: usize) -> Option<f64> {
    let rank = (sorted.len() * share).div_ceil(of).max(1);
    sorted.get(rank - 1).map(|samples| *samples as f64)
}

/// Means over the objects of their scores, `scores`, with quantiles over the windows of all of them, `all`. What an
/// object has no windows for has no mean; of what was reached, the objects count that reached it.
pub(crate) fn mean(scores: &[StopScores], all: &StopScores) -> StopScores {
    let every = |get: fn(&StopScores) -> Option<f64>| {
        let sum: Option<f64> = scores.iter().map(get).sum();
        sum.filter(|_| !scores.is_empty()).map(|sum| sum / scores.len() as f64)
    };
    let those = |get: fn(&StopScores) -> Option<f64>| statistics::mean(scores.iter().filter_map(get));
    StopScores {
        samples: every(|s| s.samples),
        samples_median: all.samples_median,
        samples_p90: all.samples_p90,
        attained: every(|s| s.attained),
        attained_reached: those(|s| s.attained_reached),
        stated: those(|s| s.stated),
        never: every(|s| s.never),
    }
}

/// Sums over the windows of a press: samples, attained, number.
type Sums = [f64; 3];

/// 95 % intervals of the means over objects of `samples` and `attained`, see [`bootstrap`].
pub(crate) fn intervals(objects: &[Vec<&PressStops>]) -> [Option<[f64; 2]>; 2] {
    let sums = |press: &&PressStops| -> Sums {
        let windows = press.windows.iter();
        windows.fold([0.0; 3], |[samples, attained, count], w| {
            [samples + w.samples as f64, attained + w.attained, count + 1.0]
        })
    };
    let objects: Vec<Vec<Sums>> = objects
        .iter()
        .map(|presses| presses.iter().map(sums).collect())
        .collect();
    bootstrap(&objects, Streams::new(1), |drawn| {
        let mut means = [(!drawn.is_empty()).then_some(0.0); 2];
        for presses in drawn {
            let mut total = [0.0; 3];
            for sums in presses {
                total.iter_mut().zip(*sums).for_each(|(total, v)| *total += v);
            }
            for (mean, sum) in means.iter_mut().zip(total) {
                let own = (total[2] > 0.0).then(|| sum / total[2] / drawn.len() as f64);
                *mean = mean.zip(own).map(|(mean, own)| mean + own);
            }
        }
        means
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(windows: &[(usize, bool, f64)]) -> PressStops {
        let window = |&(samples, reached, attained): &(usize, bool, f64)| WindowStop {
            samples,
            reached,
            stated: 0.9,
            attained,
        };
        PressStops {
            windows: windows.iter().map(window).collect(),
            failed: 0,
        }
    }

    fn near(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-12)
    }

    /// Ten windows of one press by hand: the share that never reached, and the quantiles.
    #[test]
    fn windows_of_a_press_by_hand() {
        let mut windows: Vec<(usize, bool, f64)> = (1..=9).map(|k| (k, true, 1.0)).collect();
        windows.push((100, false, 0.0));
        let scores = pool([&press(&windows)]);
        assert!(near(scores.samples, 14.5) && near(scores.samples_median, 5.0) && near(scores.samples_p90, 9.0));
        assert!(near(scores.attained, 0.9) && near(scores.attained_reached, 1.0) && near(scores.never, 0.1));
        assert!(near(scores.stated, 0.9));
        assert_eq!(pool([&PressStops::default()]), StopScores::default());
    }

    /// Objects count alike, however many windows they have. A single press an object leaves nothing to draw anew.
    #[test]
    fn objects_count_alike() {
        let (few, many) = (press(&[(10, true, 1.0)]), press(&[(2, true, 0.5); 7]));
        let scores = [pool([&few]), pool([&many])];
        let all = pool([&few, &many]);
        let mean = mean(&scores, &all);
        assert!(near(mean.samples, 6.0) && near(mean.attained, 0.75) && near(mean.samples_median, 2.0));
        let [samples, attained] = intervals(&[vec![&few], vec![&many]]);
        let is = |interval: Option<[f64; 2]>, value| interval.is_some_and(|i| i.iter().all(|v| near(Some(*v), value)));
        assert!(is(samples, 6.0) && is(attained, 0.75), "{samples:?}, {attained:?}");
        assert_eq!(intervals(&[]), [None, None]);
        assert_eq!(super::mean(&[], &all).samples, None);
    }
}
