//! Means over presses with their standard errors.

use super::score::PressScores;
use spts_recon::statistics::{Sample, mean, two_sided};

/// Probability with which a mean of nothing but chance is taken to stand out.
pub(super) const CHANCE: f64 = 0.01;

/// A mean over the sessions of a study, and its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeanWithError {
    /// Mean.
    pub mean: f64,
    /// Its standard error.
    pub se: f64,
    /// Number of sessions S.
    pub sessions: usize,
}

impl MeanWithError {
    /// Whether the mean is further from zero than chance brings it once in 1/[`CHANCE`]: by Student's t test with S − 1
    /// degrees of freedom; and where all sessions have the same value, so that there is no error to measure it by, by
    /// the test of signs, p = 2^(1 − S).
    pub(super) fn stands_out(self) -> bool {
        let freedom = u32::try_from(self.sessions.saturating_sub(1)).unwrap_or(u32::MAX);
        if self.mean.abs() <= 0.0 || freedom == 0 {
            return false;
        }
        // equal values leave the rounding of their mean
        let chance = if self.se > 1e-12 * self.mean.abs() {
            two_sided(self.mean / self.se, freedom)
        } else {
            (-f64::from(freedom)).exp2()
        };
        chance < CHANCE
    }

    /// Whether chance alone could make it stand out: it is not zero in every session.
    pub(super) fn can_stand_out(self) -> bool {
        self.mean.abs() > 0.0 || self.se > 0.0
    }
}

/// Mean over sessions and objects of `values[object][session]`, with its standard error s/√S: s is the standard
/// deviation of the S sessions' means over the objects.
///
/// Every session has presses, noise and a learned dictionary of its own, so sessions are independent; the objects of
/// one session share the dictionary and are not. The objects are the ones that were asked about, not a sample of
/// others.
pub(crate) fn estimate(values: &[Vec<f64>]) -> MeanWithError {
    let sessions = values.iter().map(Vec::len).min().unwrap_or(0);
    let of_session = |k: usize| mean(values.iter().map(|v| v[k])).unwrap_or_default();
    let means: Vec<f64> = (0..sessions).map(of_session).collect();
    Sample::of(&means).map_or_else(MeanWithError::default, |sample| MeanWithError {
        mean: sample.mean,
        se: sample.standard_error(),
        sessions,
    })
}

/// Scores of a chain: `[object][session][key]`.
pub(super) type ScoreTable = Vec<Vec<Vec<PressScores>>>;

/// Mean of `get` at the key with index `key`.
pub(super) fn level(scores: &ScoreTable, key: usize, get: impl Fn(&PressScores) -> f64) -> MeanWithError {
    let of_object = |sessions: &Vec<Vec<PressScores>>| sessions.iter().map(|keys| get(&keys[key])).collect();
    estimate(&scores.iter().map(of_object).collect::<Vec<_>>())
}

/// Mean of `get` for `variant` less that for `reference`, press by press: noise that both share cancels.
pub(super) fn change(
    variant: &ScoreTable,
    reference: &ScoreTable,
    key: usize,
    get: impl Fn(&PressScores) -> f64,
) -> MeanWithError {
    let of_object = |(a, b): (&Vec<Vec<PressScores>>, &Vec<Vec<PressScores>>)| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| get(&a[key]) - get(&b[key])).collect()
    };
    estimate(&variant.iter().zip(reference).map(of_object).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Two objects in three sessions: means over the objects 1, 3 and 5, of mean 3 and variance 4, whatever the objects
    /// differ by.
    #[test]
    fn sessions_are_the_sample() {
        let found = estimate(&[vec![-9.0, 3.0, 7.0], vec![11.0, 3.0, 3.0]]);
        assert_relative_eq!(found.mean, 3.0, max_relative = 1e-15);
        assert_relative_eq!(found.se, (4.0_f64 / 3.0).sqrt(), max_relative = 1e-15);
    }

    /// A shift that is the same in every press has no error, however much the presses differ.
    #[test]
    fn paired_changes_cancel_what_is_shared() {
        let press = |iou| {
            vec![PressScores {
                iou: [iou; 3],
                ..PressScores::default()
            }]
        };
        let before: ScoreTable = vec![vec![press(0.25), press(0.75)]];
        let after: ScoreTable = vec![vec![press(0.375), press(0.875)]];
        let found = change(&after, &before, 0, |s| s.iou[0]);
        assert_relative_eq!(found.mean, 0.125, max_relative = 1e-15);
        assert!(found.se <= 0.0);
        assert!(level(&before, 0, |s| s.iou[0]).se > 0.2);
    }

    /// Student's quantiles at 1 % are 9.925 for 3 sessions and 3.250 for 10; equal values stand out by their signs,
    /// from the eighth session on: 2⁻⁷ < 1 % < 2⁻⁶.
    #[test]
    fn few_sessions_need_a_larger_distance() {
        let stands_out = |mean: f64, se: f64, sessions: usize| MeanWithError { mean, se, sessions }.stands_out();
        assert!(!stands_out(-9.8, 1.0, 3) && stands_out(-10.0, 1.0, 3));
        assert!(!stands_out(3.2, 1.0, 10) && stands_out(3.3, 1.0, 10));
        assert!(!stands_out(0.1, 0.0, 7) && stands_out(0.1, 0.0, 8));
        assert!(!stands_out(0.0, 0.0, 10) && !stands_out(1.0, 0.0, 1));
    }
}
