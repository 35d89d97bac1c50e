//! Prediction of new sessions: spans for their values, and whether these hold.

use super::statistics::{mean, sd};
use serde::Serialize;
use spts_recon::statistics::student_t;

/// Probability that a new session's value lies in the predicted span.
pub const COVERAGE: f64 = 0.9;
/// Probability that it does not.
const OUTSIDE: f64 = 0.1;

/// Span in which the value of a new session lies with probability [`COVERAGE`], given those of earlier sessions: mean ±
/// t·s·√(1 + 1/n), with the standard deviation s (n − 1 degrees of freedom) and the two-sided quantile t of Student's
/// distribution. Exact for Gaussian values. A single value predicts only itself. `None` without values.
///
/// Source: G. J. Hahn, W. Q. Meeker, *Statistical Intervals* (1991), §4.4.
///
/// ```
/// use spts_studies::calibrate::predicted;
///
/// let (low, high) = predicted(&[0.9, 1.0, 1.1]).expect("three sessions");
/// assert!(low < 0.7 && high > 1.3, "few sessions predict a wide span");
/// assert_eq!(predicted(&[]), None);
/// ```
pub fn predicted(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len();
    match values {
        [] => None,
        [only] => Some((*only, *only)),
        _ => {
            let t = student_t(OUTSIDE, u32::try_from(n - 1).unwrap_or(u32::MAX));
            let (n, freedom) = (n as f64, n as f64 - 1.0);
            // `sd` divides by n
            let s = sd(values) * (n / freedom).sqrt();
            let half = t * s * (1.0 + 1.0 / n).sqrt();
            let centre = mean(values);
            Some((centre - half, centre + half))
        }
    }
}

/// One parameter: the value of each session compared with the span predicted from the other sessions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedNumber {
    /// Name of the parameter.
    pub name: &'static str,
    /// Number of sessions compared with the others.
    pub sessions: usize,
    /// Number of sessions inside the predicted span.
    pub inside: usize,
    /// Number of sessions between the smallest and the largest value of the others.
    pub inside_range: usize,
    /// Names of the sessions outside the predicted span.
    pub outside: Vec<String>,
}

/// Test of the spans: every session is left out in turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedInside {
    /// Nominal share of the spans, [`COVERAGE`].
    pub coverage: f64,
    /// Share of all values of all sessions inside the span predicted from the other sessions.
    pub share: f64,
    /// Share of all values inside the range of the other sessions' values.
    pub share_of_range: f64,
    /// One entry for each parameter.
    pub numbers: Vec<PredictedNumber>,
}

impl PredictedInside {
    /// All `numbers` together; `None` without one.
    pub(super) fn of(numbers: Vec<PredictedNumber>) -> Option<Self> {
        let all: usize = numbers.iter().map(|n| n.sessions).sum();
        let share = |get: fn(&PredictedNumber) -> usize| numbers.iter().map(get).sum::<usize>() as f64 / all as f64;
        (all > 0).then(|| Self {
            coverage: COVERAGE,
            share: share(|n| n.inside),
            share_of_range: share(|n| n.inside_range),
            numbers: numbers.clone(),
        })
    }
}

/// Leaves each of the `sessions`, with their values of the parameter `name`, out in turn; `limits` are the smallest and
/// the largest valid value. `None` with fewer than three sessions: two are the fewest that predict a third.
pub(super) fn leave_one_out(name: &'static str, limits: [f64; 2], sessions: &[(&str, f64)]) -> Option<PredictedNumber> {
    if sessions.len() < 3 {
        return None;
    }
    let (mut outside, mut inside_range) = (Vec::new(), 0);
    for (left_out, (session, value)) in sessions.iter().enumerate() {
        let others = sessions.iter().enumerate().filter(|(i, _)| *i != left_out);
        let others: Vec<f64> = others.map(|(_, (_, v))| *v).collect();
        if !predicted(&others).is_some_and(|span| {
            let (low, high) = clipped(span, limits);
            (low..=high).contains(value)
        }) {
            outside.push((*session).to_owned());
        }
        let inside = others.iter().any(|v| v <= value) && others.iter().any(|v| v >= value);
        inside_range += usize::from(inside);
    }
    Some(PredictedNumber {
        name,
        sessions: sessions.len(),
        inside: sessions.len() - outside.len(),
        inside_range,
        outside,
    })
}

/// `span` within `limits`, lowest and highest.
pub(super) fn clipped((low, high): (f64, f64), [lowest, highest]: [f64; 2]) -> (f64, f64) {
    (low.clamp(lowest, highest), high.clamp(lowest, highest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use rand::RngExt as _;
    use spts_models::Streams;

    /// s = 1 of [1, 2, 3]: 2 ± 2.920·√(4/3). A new Gaussian value falls inside with the probability the span is for.
    #[test]
    fn a_new_value_falls_inside_as_often_as_said() {
        let (low, high) = predicted(&[1.0, 2.0, 3.0]).unwrap();
        let half = 2.919_986 * (4.0_f64 / 3.0).sqrt();
        assert_abs_diff_eq!(low, 2.0 - half, epsilon = 1e-5);
        assert_abs_diff_eq!(high, 2.0 + half, epsilon = 1e-5);
        assert_eq!((predicted(&[5.0]), predicted(&[])), (Some((5.0, 5.0)), None));

        let mut rng = Streams::new(1).rng("predict", 0);
        // a sum of twelve uniform numbers, Gaussian within 1 % of probability
        let mut gaussian = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let trials = 4000;
        let inside = (0..trials).filter(|_| {
            let known: Vec<f64> = (0..5).map(|_| gaussian()).collect();
            let (low, high) = predicted(&known).unwrap();
            (low..=high).contains(&gaussian())
        });
        let share = inside.count() as f64 / f64::from(trials);
        // four standard errors √(.9·.1/4000)
        assert_abs_diff_eq!(share, COVERAGE, epsilon = 0.019);
    }

    #[test]
    fn every_session_is_held_against_the_others() {
        let limits = [0.0, 10.0];
        let four = leave_one_out("x", limits, &[("a", 1.0), ("b", 2.0), ("c", 1.5), ("far", 9.0)]);
        let two = leave_one_out("x", limits, &[("a", 0.1), ("b", 0.2)]);
        assert_eq!(two, None, "two sessions at least predict a third");
        let found = PredictedInside::of(four.into_iter().collect()).unwrap();
        assert_eq!(found.numbers[0].outside, ["far"]);
        assert_abs_diff_eq!(found.share, 0.75);
        // a and far are ends of the range
        assert_abs_diff_eq!(found.share_of_range, 0.5);
        assert_eq!(PredictedInside::of(Vec::new()), None);
    }

    #[test]
    fn spans_end_at_the_limits() {
        assert_eq!(clipped((-0.1, 0.4), [0.0, 0.3]), (0.0, 0.3));
        assert_eq!(clipped((-0.4, -0.1), [0.0, 1.0]), (0.0, 0.0));
    }
}
