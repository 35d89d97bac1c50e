//! The comparison as tables for the terminal.

use super::CompareReport;
use spts_eval::decoders::label;

fn verdict(ok: bool) -> &'static str {
    if ok { "ok" } else { "DIFFERS" }
}

/// One line a number, then one a curve.
pub(super) fn table(report: &CompareReport) -> String {
    let mut out = format!(
        "{:<8} {:<20} {:>20} {:>20}  {}\n",
        "session", "statistic", "real", "twin", "tolerance"
    );
    let show = |value: f64, error: Option<f64>| match error {
        // nothing to form it from, such as the share of outliers without an outlier
        _ if value.is_nan() => "–".to_owned(),
        Some(error) if error.is_nan() => format!("{value:.5}"),
        Some(error) => format!("{value:.5} ± {error:.5}"),
        None => format!("{value:.5}"),
    };
    for s in report.statistics.iter().chain(&report.not_modelled) {
        out.push_str(&format!(
            "{:<8} {:<20} {:>20} {:>20}  {:<18} {}\n",
            s.session,
            s.name,
            show(s.real, s.real_standard_error),
            show(s.twin, s.twin_standard_error),
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
            label(c.decode),
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
