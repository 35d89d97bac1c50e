//! Statistics of the recordings, real and simulated, with the allowed differences.

use super::ComparedSession;
use crate::calibrate::SessionEstimates;
use serde::Serialize;

/// One statistic of a session, such as the noise, in the recordings of the real skin and in those of its twin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistic {
    /// Object.
    pub session: String,
    /// Name.
    pub name: &'static str,
    /// Value in the recordings of the skin.
    pub real: f64,
    /// Standard error of that value; `None` if there is none.
    pub real_standard_error: Option<f64>,
    /// Value in the twin's recordings.
    pub twin: f64,
    /// Standard error of that value; `None` if there is none.
    pub twin_standard_error: Option<f64>,
    /// Allowed difference, in words.
    pub tolerance: &'static str,
    /// Whether the difference is allowed; `None` for effects that the readout does not model.
    pub ok: Option<bool>,
}

/// What difference is allowed.
#[derive(Debug, Clone, Copy)]
enum Allowed {
    /// |twin − real| relative to |real|.
    Share(f64),
    /// |twin − real|.
    Difference(f64),
    /// The larger value divided by the smaller; both must be positive.
    Factor(f64),
}

impl Allowed {
    fn holds(self, real: f64, twin: f64) -> bool {
        match self {
            Self::Share(share) => (twin - real).abs() <= share * real.abs(),
            Self::Difference(most) => (twin - real).abs() <= most,
            Self::Factor(factor) => real > 0.0 && twin > 0.0 && (twin / real).max(real / twin) <= factor,
        }
    }
}

/// Numbers that are compared, the tolerance, and its words.
const COMPARED: [(&str, Allowed, &str); 7] = [
    ("residual", Allowed::Share(0.15), "15 %"),
    ("h1", Allowed::Difference(0.01), "0.01"),
    ("h2", Allowed::Difference(0.01), "0.01"),
    ("outliers_5sd", Allowed::Factor(1.5), "factor 1.5"),
    ("late_per_flip", Allowed::Share(0.30), "30 %"),
    ("idle_noise", Allowed::Share(0.20), "20 %"),
    ("kurtosis", Allowed::Factor(2.0), "factor 2"),
];

/// Names of [`COMPARED`].
pub(super) const COMPARED_NAMES: [&str; COMPARED.len()] = {
    let mut names = [""; COMPARED.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = COMPARED[k].0;
        k += 1;
    }
    names
};

/// The number `name` of a session, where it has one.
pub(super) fn value_of(session: &SessionEstimates, name: &str) -> Option<f64> {
    session.numbers.get(name).map(|n| n.value).filter(|v| v.is_finite())
}

/// Rounding of a step that is found as a range over a whole number: relative.
const STEP_ROUNDING: f64 = 1e-9;
/// Largest distance of two quantiles over the range of the output.
const QUANTILE_SHARE: f64 = 0.10;

/// Every statistic of every session.
#[must_use]
pub fn statistics(compared: &[ComparedSession]) -> Vec<Statistic> {
    compared.iter().flat_map(|c| session(&c.real, &c.twin)).collect()
}

fn session(real: &SessionEstimates, twin: &SessionEstimates) -> Vec<Statistic> {
    let mut rows = Vec::new();
    let mut push = |name, values: [f64; 2], errors: [Option<f64>; 2], tolerance, ok| {
        rows.push(Statistic {
            session: real.session.clone(),
            name,
            real: values[0],
            real_standard_error: errors[0],
            twin: values[1],
            twin_standard_error: errors[1],
            tolerance,
            ok,
        });
    };
    for (name, allowed, words) in COMPARED {
        let (Some(r), Some(t)) = (real.numbers.get(name), twin.numbers.get(name)) else {
            continue;
        };
        let ok = allowed.holds(r.value, t.value);
        push(
            name,
            [r.value, t.value],
            [r.standard_error, t.standard_error],
            words,
            Some(ok),
        );
    }
    let step_v = |s: &SessionEstimates| s.steps.map_or(f64::NAN, |s| s.step_v);
    let steps_v = [step_v(real), step_v(twin)];
    let same = (steps_v[0] - steps_v[1]).abs() <= STEP_ROUNDING * steps_v[0].abs();
    push("step_v", steps_v, [None; 2], "exact", Some(same));
    let gap = quantile_gap(&real.output_quantiles_v, &twin.output_quantiles_v);
    push(
        "quantile_gap",
        [0.0, gap],
        [None; 2],
        "10 % of the range",
        Some(gap <= QUANTILE_SHARE),
    );
    rows
}

/// Numbers of the recordings that the readout does not model.
const NOT_MODELLED: [&str; 3] = ["idle_sd", "idle_parity", "unexplained_outliers"];

/// Statistics of effects that the readout does not model, for every session, without a verdict.
#[must_use]
pub fn not_modelled(compared: &[ComparedSession]) -> Vec<Statistic> {
    let row = |c: &ComparedSession, name: &'static str| {
        let (r, t) = (c.real.numbers.get(name)?, c.twin.numbers.get(name)?);
        Some(Statistic {
            session: c.real.session.clone(),
            name,
            real: r.value,
            real_standard_error: r.standard_error,
            twin: t.value,
            twin_standard_error: t.standard_error,
            tolerance: "not modelled",
            ok: None,
        })
    };
    let rows = compared.iter().flat_map(|c| NOT_MODELLED.map(|name| row(c, name)));
    rows.flatten().collect()
}

/// Largest distance of the quantiles over the range of the real ones.
fn quantile_gap(real: &[f64], twin: &[f64]) -> f64 {
    let range = real.last().unwrap_or(&0.0) - real.first().unwrap_or(&0.0);
    real.iter().zip(twin).map(|(r, t)| (r - t).abs()).fold(0.0, f64::max) / range
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_mean_what_they_say() {
        assert!(Allowed::Share(0.15).holds(0.2, 0.229) && !Allowed::Share(0.15).holds(0.2, 0.231));
        assert!(Allowed::Factor(1.5).holds(0.01, 0.0149) && !Allowed::Factor(1.5).holds(0.01, 0.0066));
        assert!(
            !Allowed::Factor(2.0).holds(0.0, 0.0),
            "nothing is not a factor of nothing"
        );
        assert!(Allowed::Difference(0.01).holds(-0.02, -0.012) && !Allowed::Difference(0.01).holds(0.0, f64::NAN));
        // quantiles 1 V apart at most, over a range of 10 V
        assert!((quantile_gap(&[-5.0, 0.0, 5.0], &[-4.0, 0.5, 5.0]) - 0.1).abs() < 1e-15);
    }
}
