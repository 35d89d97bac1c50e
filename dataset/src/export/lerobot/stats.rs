//! Statistics of features in LeRobot's form: for every episode, and merged over all.

/// Names of the statistics, in the order of [`FeatureStats::values`].
pub(super) const NAMES: [&str; 9] = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"];
/// The quantiles among them.
const QUANTILES: [f64; 5] = [0.01, 0.1, 0.5, 0.9, 0.99];
const MIN: usize = 0;
const MAX: usize = 1;
const MEAN: usize = 2;
const STD: usize = 3;
const FIRST_QUANTILE: usize = 4;

/// Statistics of a feature over some frames.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FeatureStats {
    /// Number of frames.
    pub(super) count: u64,
    /// Every statistic, entry by entry of the feature.
    pub(super) values: [Vec<f64>; NAMES.len()],
}

impl FeatureStats {
    /// Statistics of `frames`, one frame of `width` entries after the other: the standard deviation of the frames
    /// themselves (divided by their number) and quantiles with linear interpolation between frames.
    pub(super) fn of(frames: &[f64], width: usize) -> Self {
        let count = frames.len() / width.max(1);
        let mut values: [Vec<f64>; NAMES.len()] = std::array::from_fn(|_| Vec::with_capacity(width));
        let mut sorted = Vec::with_capacity(count);
        for entry in 0..width {
            sorted.clear();
            sorted.extend(frames.iter().skip(entry).step_by(width));
            sorted.sort_by(f64::total_cmp);
            let (Some(least), Some(most)) = (sorted.first(), sorted.last()) else {
                continue;
            };
            // between the least and the most, whatever the sum rounds to
            let mean = (sorted.iter().sum::<f64>() / count as f64).clamp(*least, *most);
            let square: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
            values[MIN].push(*least);
            values[MAX].push(*most);
            values[MEAN].push(mean);
            values[STD].push((square / count as f64).sqrt());
            for (k, q) in QUANTILES.into_iter().enumerate() {
                values[FIRST_QUANTILE + k].push(quantile(&sorted, q));
            }
        }
        let count = count as u64;
        Self { count, values }
    }
}

/// Quantile `q` of `sorted`, which has at least one value.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let below = crate::spec::whole(at.floor());
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * (at - below as f64)
}

/// Statistics of a feature over all episodes so far. Least, most, mean and standard deviation are those of all frames;
/// a quantile is the mean of the episodes' quantiles, weighted by their frames, as LeRobot merges them.
#[derive(Debug, Clone)]
pub(super) struct MergedStats(FeatureStats);

impl MergedStats {
    /// Of no episode.
    pub(super) fn new(width: usize) -> Self {
        let mut values: [Vec<f64>; NAMES.len()] = std::array::from_fn(|_| vec![0.0; width]);
        values[MIN] = vec![f64::INFINITY; width];
        values[MAX] = vec![f64::NEG_INFINITY; width];
        Self(FeatureStats { count: 0, values })
    }

    /// Adds an episode.
    pub(super) fn add(&mut self, episode: &FeatureStats) {
        let all = &mut self.0;
        let before = all.count as f64;
        all.count += episode.count;
        let share = episode.count as f64 / all.count as f64;
        for entry in 0..all.values[MIN].len() {
            let new: [f64; NAMES.len()] = std::array::from_fn(|k| episode.values[k][entry]);
            let value = |k: usize| all.values[k][entry];
            let step = new[MEAN] - value(MEAN);
            // until the end the place of the deviation holds the sum of squares about the mean
            let squares = new[STD].powi(2) * episode.count as f64 + step * step * before * share;
            let mean = value(MEAN) + step * share;
            all.values[STD][entry] += squares;
            all.values[MEAN][entry] = mean;
            all.values[MIN][entry] = all.values[MIN][entry].min(new[MIN]);
            all.values[MAX][entry] = all.values[MAX][entry].max(new[MAX]);
            for (all, new) in all.values.iter_mut().zip(new).skip(FIRST_QUANTILE) {
                all[entry] += (new - all[entry]) * share;
            }
        }
    }

    /// Statistics of all frames.
    pub(super) fn total(mut self) -> FeatureStats {
        let count = self.0.count.max(1) as f64;
        let squares = &mut self.0.values[STD];
        squares.iter_mut().for_each(|square| *square = (*square / count).sqrt());
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against NumPy 2: `a = [[1, 10], [4, -2], [2, 7], [8, 0.5]]`, its `min`, `max`, `mean`, `std` and `quantile`
    /// along axis 0. The tolerance is a few roundings of numbers about 10.
    #[test]
    fn statistics_are_those_of_numpy() {
        let frames = [1.0, 10.0, 4.0, -2.0, 2.0, 7.0, 8.0, 0.5];
        let expected = [
            [1.0, -2.0],
            [8.0, 10.0],
            [3.75, 3.875],
            [2.680_951_323_690_902, 4.826_683_644_076_955],
            [1.03, -1.925],
            [1.3, -1.25],
            [3.0, 3.75],
            [6.8, 9.1],
            [7.88, 9.91],
        ];
        let found = FeatureStats::of(&frames, 2);
        assert_eq!(found.count, 4);
        for (name, (found, expected)) in NAMES.iter().zip(found.values.iter().zip(expected)) {
            for (a, b) in found.iter().zip(expected) {
                assert!((a - b).abs() < 1e-14, "{name}: {a} is not {b}");
            }
        }
    }

    /// Episodes of 3, 1 and 4 frames: all but the quantiles are those of the eight frames, within a few roundings of
    /// numbers about 1000; a quantile is the weighted mean.
    #[test]
    fn merged_statistics_are_those_of_all_frames() {
        let frames = [1000.5, 1001.25, 999.0, 1003.0, 998.5, 1000.0, 1002.75, 1001.0];
        let episodes = [&frames[..3], &frames[3..4], &frames[4..]].map(|part| FeatureStats::of(part, 1));
        let mut merged = MergedStats::new(1);
        episodes.iter().for_each(|episode| merged.add(episode));
        let (found, all) = (merged.total(), FeatureStats::of(&frames, 1));
        assert_eq!(found.count, 8);
        for k in [MIN, MAX, MEAN, STD] {
            let (a, b) = (found.values[k][0], all.values[k][0]);
            assert!((a - b).abs() < 1e-12, "{}: {a} is not {b}", NAMES[k]);
        }
        for (k, name) in NAMES.iter().enumerate().skip(FIRST_QUANTILE) {
            let weighted: f64 = episodes.iter().map(|e| e.values[k][0] * e.count as f64).sum::<f64>() / 8.0;
            assert!((found.values[k][0] - weighted).abs() < 1e-12, "{name}");
        }
    }
}
