//! Bands and distances as tables for the terminal.

use super::band::{ObjectBand, ScoreDistance};
use super::study::PerObjectReport;

/// Distances, then a line an object.
pub(super) fn tables(report: &PerObjectReport) -> String {
    let mut out = format!(
        "mean over the objects of |twin − real|, twin: mean of {} simulated skins\n\
         {:<30} {:<9} {:>3} {:<13} {:>14} {:>14} {:>15}  outside the 90 % band\n",
        report.skins, "images", "decoder", "M", "score", "|twin − real|", "between skins", "means, twin − r"
    );
    for d in &report.distances {
        out.push_str(&distance(d));
    }
    out.push_str(&format!(
        "\n{:<30} {:<9} {:>3} {:<13} {:<9} {:>6} {:>6}  {:<13}\n",
        "images", "decoder", "M", "score", "object", "real", "twin", "90 % band"
    ));
    for band in &report.objects {
        out.push_str(&object(band));
    }
    out.trim_end().to_owned()
}

fn distance(d: &ScoreDistance) -> String {
    let outside = if d.outside.is_empty() { "none" } else { &d.outside };
    format!(
        "{:<30} {:<9} {:>3} {:<13} {:>14.3} {:>14.3} {:>+15.3}  {outside}\n",
        d.images.label(),
        d.decoder,
        d.m,
        d.score,
        d.mean_abs_difference,
        d.between_skins,
        d.difference_of_means
    )
}

fn object(b: &ObjectBand) -> String {
    format!(
        "{:<30} {:<9} {:>3} {:<13} {:<9} {:>6.3} {:>6.3}  {:.3} – {:.3}{}\n",
        b.images.label(),
        b.decoder,
        b.m,
        b.score,
        b.object,
        b.real,
        b.twin,
        b.low,
        b.high,
        if b.inside { "" } else { "  outside" }
    )
}
