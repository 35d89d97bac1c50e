//! Prediction of new sessions: spans for their values, and whether these hold.

use super::statistics::{mean, sd};
use serde::Serialize;

/// Probability that a new session's value lies in the predicted span.
pub const COVERAGE: f64 = 0.9;

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
#[must_use]
pub fn predicted(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len();
    match values {
        [] => None,
        [only] => Some((*only, *only)),
        _ => {
            let (n, freedom) = (n as f64, n as f64 - 1.0);
            // `sd` divides by n
            let s = sd(values) * (n / freedom).sqrt();
            let half = student_t(COVERAGE, values.len() - 1) * s * (1.0 + 1.0 / n).sqrt();
            let centre = mean(values);
            Some((centre - half, centre + half))
        }
    }
}

/// Probability that |t| ≤ `t` for Student's distribution with `freedom` ≥ 1 degrees of freedom, and `t` ≥ 0.
///
/// Source: M. Abramowitz, I. A. Stegun, *Handbook of Mathematical Functions* (1964), 26.7.3 and 26.7.4.
fn within(t: f64, freedom: usize) -> f64 {
    let theta = (t / (freedom as f64).sqrt()).atan();
    let (sin, cos) = theta.sin_cos();
    let odd = freedom % 2 == 1;
    // sin θ·(1 + 1/2·cos² θ + 1·3/(2·4)·cos⁴ θ + …) for even degrees, sin θ·(cos θ + 2/3·cos³ θ + …) for odd ones
    let mut exponent = usize::from(odd);
    let mut term = if odd { cos } else { 1.0 };
    let mut sum = if freedom == 1 { 0.0 } else { term };
    while exponent + 4 <= freedom {
        term *= (exponent + 1) as f64 / (exponent + 2) as f64 * cos * cos;
        sum += term;
        exponent += 2;
    }
    if odd {
        (theta + sin * sum) * std::f64::consts::FRAC_2_PI
    } else {
        sin * sum
    }
}

/// The t that |t| of Student's distribution with `freedom` ≥ 1 degrees of freedom exceeds with probability 1 −
/// `probability`, in (0, 1): by bisection.
fn student_t(probability: f64, freedom: usize) -> f64 {
    let mut high = 1.0;
    while within(high, freedom) < probability {
        high *= 2.0;
    }
    let mut low = 0.0;
    // a bisection of [0, high] ends at the spacing of f64 after at most 64 halvings
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if within(middle, freedom) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
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

/// A parameter of several sessions.
pub(super) struct SessionValues<'a> {
    /// Name of the parameter.
    pub(super) name: &'static str,
    /// Smallest and largest valid value of the readout.
    pub(super) limits: [f64; 2],
    /// Sessions that determine it, with their values.
    pub(super) sessions: Vec<(&'a str, f64)>,
}

/// Leaves every session out in turn. `None` when no parameter has three sessions: two are the fewest that predict a
/// third.
pub(super) fn leave_one_out(numbers: &[SessionValues<'_>]) -> Option<PredictedInside> {
    let tested = numbers.iter().filter(|number| number.sessions.len() > 2);
    let numbers: Vec<PredictedNumber> = tested.map(one_number).collect();
    let all: usize = numbers.iter().map(|n| n.sessions).sum();
    let share = |get: fn(&PredictedNumber) -> usize| numbers.iter().map(get).sum::<usize>() as f64 / all as f64;
    (all > 0).then(|| PredictedInside {
        coverage: COVERAGE,
        share: share(|n| n.inside),
        share_of_range: share(|n| n.inside_range),
        numbers: numbers.clone(),
    })
}

fn one_number(number: &SessionValues<'_>) -> PredictedNumber {
    let SessionValues { name, limits, sessions } = number;
    let (mut outside, mut inside_range) = (Vec::new(), 0);
    for (left_out, (session, value)) in sessions.iter().enumerate() {
        let others = sessions.iter().enumerate().filter(|(i, _)| *i != left_out);
        let others: Vec<f64> = others.map(|(_, (_, v))| *v).collect();
        let contains = |span: Option<(f64, f64)>| span.is_some_and(|(low, high)| low <= *value && *value <= high);
        if !contains(predicted(&others).map(|span| clipped(span, *limits))) {
            outside.push((*session).to_owned());
        }
        inside_range += usize::from(contains(super::statistics::range(&others)));
    }
    PredictedNumber {
        name,
        sessions: sessions.len(),
        inside: sessions.len() - outside.len(),
        inside_range,
        outside,
    }
}

/// `span` within `limits`, lowest and highest.
pub(super) fn clipped((low, high): (f64, f64), [lowest, highest]: [f64; 2]) -> (f64, f64) {
    (low.clamp(lowest, highest), high.clamp(lowest, highest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use rand::RngExt as _;
    use spts_models::Streams;

    /// Quantiles t.95 and t.975 of published tables, which have three places.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, ninety, ninety_five) in [
            (1, 6.314, 12.706),
            (2, 2.920, 4.303),
            (3, 2.353, 3.182),
            (4, 2.132, 2.776),
            (5, 2.015, 2.571),
            (9, 1.833, 2.262),
            (10, 1.812, 2.228),
            (30, 1.697, 2.042),
            (120, 1.658, 1.980),
        ] {
            assert_abs_diff_eq!(student_t(0.90, freedom), ninety, epsilon = 0.0005);
            assert_abs_diff_eq!(student_t(0.95, freedom), ninety_five, epsilon = 0.0005);
        }
        // one degree is Cauchy's distribution: t = tan(π·p/2)
        assert_relative_eq!(student_t(0.5, 1), 1.0, max_relative = 1e-14);
    }

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
        let values = |name, sessions: &[(&'static str, f64)]| SessionValues {
            name,
            limits: [0.0, 10.0],
            sessions: sessions.to_vec(),
        };
        let four = values("x", &[("a", 1.0), ("b", 2.0), ("c", 1.5), ("far", 9.0)]);
        let found = leave_one_out(&[four, values("rare", &[("a", 0.5)])]).unwrap();
        assert_eq!(found.numbers.len(), 1, "two sessions at least predict a third");
        assert_eq!(found.numbers[0].outside, ["far"]);
        assert_abs_diff_eq!(found.share, 0.75);
        // a and far are ends of the range
        assert_abs_diff_eq!(found.share_of_range, 0.5);
        assert_eq!(leave_one_out(&[values("x", &[("a", 0.1), ("b", 0.2)])]), None);
    }

    #[test]
    fn spans_end_at_the_limits() {
        assert_eq!(clipped((-0.1, 0.4), [0.0, 0.3]), (0.0, 0.3));
        assert_eq!(clipped((-0.4, -0.1), [0.0, 1.0]), (0.0, 0.0));
    }
}
