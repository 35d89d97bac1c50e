//! Means over presses with their standard errors.

use super::tally::Score;

/// A mean and its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Estimate {
    pub(super) mean: f64,
    pub(super) se: f64,
}

impl Estimate {
    /// Whether the mean is more than two standard errors away from zero.
    pub(super) fn stands_out(self) -> bool {
        self.mean.abs() > 2.0 * self.se
    }
}

/// Mean over the objects of each object's mean over its sessions, `values[object][session]`, with its standard error
///
/// √(Σₒ s²ₒ/Sₒ) / O,
///
/// s²ₒ being the variance between the Sₒ sessions of object o and O the number of objects: the objects are the ones that were
/// asked about, not a sample of others. Every session has its own press and its own noise, so sessions are independent.
#[expect(clippy::cast_precision_loss, reason = "a handful of objects and sessions")]
pub(super) fn estimate(values: &[Vec<f64>]) -> Estimate {
    let objects = values.len().max(1) as f64;
    let (mut sum, mut square) = (0.0, 0.0);
    for sessions in values {
        let count = sessions.len().max(1) as f64;
        let mean = sessions.iter().sum::<f64>() / count;
        let deviation: f64 = sessions.iter().map(|v| (v - mean).powi(2)).sum();
        sum += mean;
        square += deviation / (count - 1.0).max(1.0) / count;
    }
    Estimate {
        mean: sum / objects,
        se: square.sqrt() / objects,
    }
}

/// Scores of a chain: `[object][session][key]`.
pub(super) type Scores = Vec<Vec<Vec<Score>>>;

/// Estimate of `get` at the key with index `key`.
pub(super) fn level(scores: &Scores, key: usize, get: impl Fn(&Score) -> f64) -> Estimate {
    let of_object = |sessions: &Vec<Vec<Score>>| sessions.iter().map(|keys| get(&keys[key])).collect();
    estimate(&scores.iter().map(of_object).collect::<Vec<_>>())
}

/// Estimate of `get` for `variant` less that for `reference`, press by press: noise that both share cancels.
pub(super) fn change(variant: &Scores, reference: &Scores, key: usize, get: impl Fn(&Score) -> f64) -> Estimate {
    let of_object = |(a, b): (&Vec<Vec<Score>>, &Vec<Vec<Score>>)| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| get(&a[key]) - get(&b[key])).collect()
    };
    estimate(&variant.iter().zip(reference).map(of_object).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Two objects: sessions 1, 3 (mean 2, variance 2) and 5, 5, 8 (mean 6, variance 3). Mean 4; √(2/2 + 3/3)/2.
    #[test]
    fn objects_count_alike_and_their_variances_add() {
        let found = estimate(&[vec![1.0, 3.0], vec![5.0, 5.0, 8.0]]);
        assert_relative_eq!(found.mean, 4.0, max_relative = 1e-15);
        assert_relative_eq!(found.se, 2.0_f64.sqrt() / 2.0, max_relative = 1e-15);
    }

    /// A shift that is the same in every press has no error, however much the presses differ.
    #[test]
    fn paired_changes_cancel_what_is_shared() {
        let press = |iou| {
            vec![Score {
                iou: [iou; 3],
                ..Score::default()
            }]
        };
        let before: Scores = vec![vec![press(0.25), press(0.75)]];
        let after: Scores = vec![vec![press(0.375), press(0.875)]];
        let found = change(&after, &before, 0, |s| s.iou[0]);
        assert_relative_eq!(found.mean, 0.125, max_relative = 1e-15);
        assert!(found.se <= 0.0 && found.stands_out());
        assert!(level(&before, 0, |s| s.iou[0]).se > 0.2);
    }
}
