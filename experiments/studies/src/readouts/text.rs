//! The benchmark as text tables.

use super::report::{GOOD_IOU, ReadoutTrial, ReadoutsReport};
use spts_recon::statistics::Band;

/// "0.87 ± 0.03": mean and half width of a band.
fn band(band: Option<Band>, scale: f64, digits: usize) -> String {
    band.map_or_else(
        || "–".to_owned(),
        |b| {
            format!(
                "{:.digits$} ± {:.digits$}",
                scale * b.mean,
                scale * 0.5 * (b.high - b.low)
            )
        },
    )
}

impl ReadoutsReport {
    /// One Markdown table for each size.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for wire in &self.wires {
            out.push_str(&format!(
                "{} taxels, {:.2} µs a measurement\n\n\
                 | readout | wires | Rf, kΩ | M | images/s | IoU | place, px | class \
                 | touch noticed, ms | and placed, ms |\n\
                 |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
                wire.taxels,
                1e6 * wire.period_s
            ));
            for row in self.rows.iter().filter(|row| row.taxels == wire.taxels) {
                for trial in &row.trials {
                    let mark = if row.deciding() == Some(trial) { "**" } else { "" };
                    out.push_str(&format!(
                        "| {} | {} | {:.2} | {mark}{}{mark} | {} |\n",
                        row.label,
                        row.wires,
                        1e-3 * row.feedback_ohm,
                        trial.measurements,
                        cells(trial)
                    ));
                }
            }
            out.push('\n');
        }
        out.push_str(&format!(
            "Marked like **this** is, for every readout, the smallest M with a mean IoU of {GOOD_IOU} or, if there is none, \
             the M with the largest IoU. The number after ± is half the width of the 90 % band over the repetitions.\n"
        ));
        out
    }
}

/// The columns of a trial after M.
fn cells(t: &ReadoutTrial) -> String {
    let notes = [(t.lost, "no image"), (t.unnoticed, "not noticed")];
    let [lost, unnoticed] = notes.map(|(share, what)| {
        if share > 0.0 {
            format!(" ({:.0} % {what})", 100.0 * share)
        } else {
            String::new()
        }
    });
    format!(
        "{:.0} | {} | {}{lost} | {} | {}{unnoticed} | {}",
        t.frames_hz,
        band(t.iou, 1.0, 2),
        band(t.place_px, 1.0, 2),
        band(t.accuracy, 1.0, 2),
        band(t.noticed_s, 1e3, 3),
        band(t.placed_s, 1e3, 2),
    )
}
