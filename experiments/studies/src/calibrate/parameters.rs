//! Parameters of the readout that sessions determine, and the spans for a profile.

use super::predict::{PredictedInside, SessionValues, clipped, leave_one_out, predicted};
use super::session::SessionEstimates;
use super::statistics::{Estimated, mean, sd};
use serde::Serialize;

/// A parameter and where it comes from.
pub(super) struct Parameter {
    /// Section and key of the profile.
    pub(super) name: &'static str,
    /// Name of the value in [`super::PressNumbers`] that has its uncertainty.
    number: &'static str,
    /// Smallest and largest valid value of the readout; rates, shares and noise are not negative.
    limits: [f64; 2],
    /// Value of a session; NaN if the session does not determine it.
    value: fn(&SessionEstimates) -> f64,
}

/// In the order of the profile.
const PARAMETERS: [Parameter; 8] = [
    Parameter {
        name: LATE_RATE,
        number: "late_per_flip",
        // half a beat of 52.4 measurements; see the effect `late_updates`
        limits: [0.0, 0.5 / 53.0],
        value: |s| s.value("late_per_flip"),
    },
    Parameter {
        name: "drive_offset.constant_v",
        number: "constant",
        limits: [-5.0, 5.0],
        value: |s| s.value("constant"),
    },
    Parameter {
        name: "drive_offset.asymmetry",
        number: "asymmetry",
        limits: [-0.5, 0.5],
        value: |s| s.value("asymmetry"),
    },
    Parameter {
        name: "memory.h1",
        number: "h1",
        limits: [-0.4, 0.4],
        value: |s| s.value("h1"),
    },
    Parameter {
        name: "memory.h2",
        number: "h2",
        limits: [-0.4, 0.4],
        value: |s| s.value("h2"),
    },
    Parameter {
        name: "clock_pattern.amplitude_v",
        number: "parity",
        limits: [-2.0, 2.0],
        value: |s| s.value("parity"),
    },
    Parameter {
        name: "contact_noise.fraction",
        number: "contact_fraction",
        limits: [0.0, 1.0],
        value: |s| s.value("contact_fraction"),
    },
    Parameter {
        name: "idle_noise.sd_v",
        number: "idle_noise",
        limits: [0.0, 10.0],
        value: idle_noise_v,
    },
];

/// The one parameter that is drawn once a taxel, not once a session.
const LATE_RATE: &str = "late_updates.rate";

/// A parameter of the profile, with one value for each session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedParameter {
    /// Section and key.
    pub name: &'static str,
    /// Value of every session that determines it.
    pub sessions: Vec<f64>,
    /// Span for the profile, in which a new session lies with probability [`super::COVERAGE`]; for the late rate, which
    /// differs from taxel to taxel, the spread over the taxels. `None` if no session determines it.
    pub span: Option<(f64, f64)>,
    /// Mean over the sessions (for one session, median over its presses) and standard error.
    pub estimate: Estimated,
}

/// Every parameter, from all `sessions` together, or of one.
pub(super) fn fitted_parameters(sessions: &[SessionEstimates]) -> Vec<FittedParameter> {
    PARAMETERS.iter().map(|parameter| fitted(parameter, sessions)).collect()
}

fn fitted(parameter: &Parameter, sessions: &[SessionEstimates]) -> FittedParameter {
    let values: Vec<f64> = sessions.iter().map(parameter.value).filter(|v| v.is_finite()).collect();
    let estimate = match sessions {
        [only] => Estimated {
            value: values.first().copied().unwrap_or(f64::NAN),
            ..only
                .numbers
                .get(parameter.number)
                .copied()
                .unwrap_or(Estimated::mean_of(&[]))
        },
        _ => Estimated::mean_of(&values),
    };
    let mut span = predicted(&values).map(|span| clipped(span, parameter.limits));
    // one session's own value is known better than which of its taxels are the late ones: drawn anew, they would change
    // it
    if parameter.name == LATE_RATE && sessions.len() > 1 {
        span = late_span(estimate.value, sessions).or(span);
    }
    FittedParameter {
        name: parameter.name,
        span,
        sessions: values,
        estimate,
    }
}

/// Whether every session lies in the spans that the others predict; of the late rate, its mean over the taxels. `None`
/// with fewer than three sessions.
pub(super) fn predicted_inside(sessions: &[SessionEstimates]) -> Option<PredictedInside> {
    let of = |parameter: &Parameter| {
        let values = sessions.iter().map(|s| (s.session.as_str(), (parameter.value)(s)));
        SessionValues {
            name: parameter.name,
            limits: parameter.limits,
            sessions: values.filter(|(_, v)| v.is_finite()).collect(),
        }
    };
    leave_one_out(&PARAMETERS.iter().map(of).collect::<Vec<_>>())
}

/// Noise floor before the converter, whose rounding adds step²/12.
fn idle_noise_v(s: &SessionEstimates) -> f64 {
    let step_v = s.steps.map_or(0.0, |s| s.step_v);
    (s.value("idle_noise").powi(2) - step_v.powi(2) / 12.0).max(0.0).sqrt()
}

/// Span of a uniform distribution over the taxels about `centre`, not below 0: standard deviation of the shares of late
/// flips over the loaded taxels of all sessions, less what the number of events makes of it. `None` with fewer than two
/// taxels.
fn late_span(centre: f64, sessions: &[SessionEstimates]) -> Option<(f64, f64)> {
    let cells = || sessions.iter().flat_map(|s| &s.late_cells);
    let shares: Vec<f64> = cells().map(|c| c.per_flip).collect();
    let n = shares.len() as f64;
    if n < 2.0 || !centre.is_finite() {
        return None;
    }
    let counting = mean(&cells().map(|c| c.standard_error.powi(2)).collect::<Vec<_>>());
    let variance = sd(&shares).powi(2) * n / (n - 1.0) - counting;
    // a uniform distribution reaches √3 standard deviations to either side
    let reach = (3.0 * variance.max(0.0)).sqrt().min(centre);
    Some((centre - reach, centre + reach))
}
