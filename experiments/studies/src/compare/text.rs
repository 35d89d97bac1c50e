//! The comparison as tables for the terminal.

use super::{CompareReport, PredictedStatistic};
use spts_eval::decoders::short_label;

fn verdict(ok: bool) -> &'static str {
    if ok { "ok" } else { "DIFFERS" }
}

/// A value with its standard error; a dash if it is undefined, such as the share of unexplained outliers when there are
/// no outliers.
#[must_use]
pub fn with_error(value: f64, error: Option<f64>, digits: usize) -> String {
    match error {
        _ if value.is_nan() => "–".to_owned(),
        Some(error) if !error.is_nan() => format!("{value:.digits$} ± {error:.digits$}"),
        _ => format!("{value:.digits$}"),
    }
}

/// One line a number, then one a curve.
pub(super) fn table(report: &CompareReport) -> String {
    if !report.predicted.is_empty() {
        return predicted(&report.predicted);
    }
    let mut out = format!(
        "{:<8} {:<20} {:>20} {:>20}  {}\n",
        "session", "statistic", "real", "twin", "tolerance"
    );
    for s in report.statistics.iter().chain(&report.not_modelled) {
        out.push_str(&format!(
            "{:<8} {:<20} {:>20} {:>20}  {:<18} {}\n",
            s.session,
            s.name,
            with_error(s.real, s.real_standard_error, 5),
            with_error(s.twin, s.twin_standard_error, 5),
            s.tolerance,
            s.ok.map_or("", verdict)
        ));
    }
    let distances = report.distances();
    if !distances.is_empty() {
        out.push_str("\nmean and largest |twin − real| over M = 7 … 100\n");
    }
    for c in distances {
        out.push_str(&format!(
            "{:<16} {:<13} {:.4}  {:.4}  allowed {:.2}  {}\n",
            short_label(c.decode),
            c.metric,
            c.mean_abs_difference,
            c.max_abs_difference,
            c.tolerance,
            verdict(c.ok)
        ));
    }
    out.pop();
    out
}

/// One line a number: real value and the band of the twins.
fn predicted(rows: &[PredictedStatistic]) -> String {
    let mut out = format!(
        "{:<8} {:<20} {:>10} {:>10}   {}\n",
        "session", "statistic", "real", "twin", "90 % of twins"
    );
    for row in rows {
        out.push_str(&format!(
            "{:<8} {:<20} {:>10.5} {:>10.5}   {:.5} to {:.5}  {}\n",
            row.session,
            row.name,
            row.real,
            row.twin,
            row.low,
            row.high,
            if row.inside { "inside" } else { "OUTSIDE" }
        ));
    }
    let inside = rows.iter().filter(|row| row.inside).count();
    out.push_str(&format!("inside: {inside} of {}", rows.len()));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_formed_is_a_dash() {
        assert_eq!(with_error(f64::NAN, Some(f64::NAN), 5), "–");
        assert_eq!(with_error(f64::NAN, None, 5), "–");
        assert_eq!(with_error(0.5, Some(f64::NAN), 2), "0.50");
        assert_eq!(with_error(0.5, Some(0.125), 3), "0.500 ± 0.125");
        let null = serde_json::to_string(&f64::NAN).unwrap();
        assert_eq!(null, "null", "as a statistic is written");
    }
}
