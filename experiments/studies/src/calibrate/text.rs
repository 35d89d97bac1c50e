//! Estimates as a table for the terminal.

use super::predict::PredictedInside;
use super::session::{NUMBERS, SessionEstimates};
use super::statistics::Estimated;

/// One line for each value and one column for each session: median ± standard error over the presses. Then beats, steps
/// and faults.
#[must_use]
pub fn table(sessions: &[SessionEstimates]) -> String {
    let mut out = format!("{:<22}", "");
    sessions
        .iter()
        .for_each(|s| out.push_str(&format!("{:>20}", s.session)));
    for (name, unit, _) in NUMBERS {
        let label = if unit.is_empty() {
            name.to_owned()
        } else {
            format!("{name} [{unit}]")
        };
        out.push_str(&format!("\n{label:<22}"));
        for session in sessions {
            out.push_str(&format!(
                "{:>20}",
                session.numbers.get(name).map_or_else(String::new, show)
            ));
        }
    }
    for s in sessions {
        let beats: Vec<String> = s
            .beats
            .iter()
            .map(|b| format!("{:.2} (taxel {})", b.period_measurements, b.taxel))
            .collect();
        out.push_str(&format!("\n{}: {} presses", s.session, s.presses.len()));
        match s.steps {
            Some(steps) => out.push_str(&format!(", step {:.4} mV", 1e3 * steps.step_v)),
            None => out.push_str(", values on no grid"),
        }
        out.push_str(&format!(
            ", beats [measurements]: {}",
            if beats.is_empty() {
                "none seen".to_owned()
            } else {
                beats.join(", ")
            }
        ));
        if let Some(gains) = &s.gains {
            out.push_str(&format!(
                "\n{}: gains of {} taxels against the raster session: log-sd {:.3} ± {:.3}",
                s.session,
                gains.taxels.len(),
                gains.log_sd,
                gains.standard_error
            ));
        }
        for fault in &s.faults {
            out.push_str(&format!("\n{}: {fault}", s.session));
        }
        for cell in &s.overdriven {
            out.push_str(&format!("\n{}: {cell}", s.session));
        }
        for press in &s.missed {
            out.push_str(&format!("\n{}: {press}", s.session));
        }
        if s.presses.len() == 1 {
            out.push_str(&format!(
                "\n{}: one press only: no number has an uncertainty",
                s.session
            ));
        }
    }
    out
}

fn show(e: &Estimated) -> String {
    match (e.n, e.standard_error) {
        (0, _) => "not identified".to_owned(),
        (_, None) => format!("{:.4}", e.value),
        (_, Some(error)) => format!("{:.4} ± {error:.4}", e.value),
    }
}

/// How many sessions lie in the spans that the others predict, parameter by parameter.
pub(super) fn predictions(found: &PredictedInside) -> String {
    let mut out = format!(
        "each session left out, inside the {:.0} % span that the others predict: {:.0} % of all numbers (between the others' smallest and \
         largest: {:.0} %)",
        100.0 * found.coverage,
        100.0 * found.share,
        100.0 * found.share_of_range
    );
    for n in &found.numbers {
        out.push_str(&format!("\n- {}: {} of {}", n.name, n.inside, n.sessions));
        if !n.outside.is_empty() {
            out.push_str(&format!(", not {}", n.outside.join(", ")));
        }
    }
    out
}
