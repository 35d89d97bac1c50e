//! The bent skin as a table for the terminal.

use super::study::{ArmBand, ArmReport};

/// A line a statistic.
pub(super) fn table(report: &ArmReport) -> String {
    let mut out = format!(
        "{} ({} touches), twin: {} simulated bent skins (`spts simulate arm`)\n{:<24} {:<5} {:>7} {:>7}  90 % band\n",
        report.session, report.touches, report.skins, "statistic", "unit", "real", "twin"
    );
    for band in &report.statistics {
        out.push_str(&line(band));
    }
    out.pop();
    out
}

fn line(b: &ArmBand) -> String {
    format!(
        "{:<24} {:<5} {:>7.3} {:>7.3}  {:.3} – {:.3}{}\n",
        b.statistic,
        b.unit,
        b.real,
        b.twin,
        b.low,
        b.high,
        if b.inside { "" } else { "  outside" }
    )
}
