//! The files of a comparison of the twin with recordings.

use crate::figures::{Chart, FigureError, Series, Style, save_charts};
use crate::labels::object_label;
use crate::{ReportError, per_object, write_all_or_none};
use spts::output::{OutputFolder, write_json, write_table};
use spts_eval::Table;
use spts_eval::decoders::{PublishedDecode, label, short_label};
use spts_studies::arm::ArmReport;
use spts_studies::calibrate::quantiles;
use spts_studies::compare::{CompareReport, ComparedSession, ScoreCurves};
use spts_studies::per_object::PerObjectReport;
use std::path::Path;

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "compare.csv",
    "curves.csv",
    "predicted.csv",
    per_object::TABLES[0],
    per_object::TABLES[1],
    per_object::TABLES[2],
    ARM[0],
    ARM[1],
];

/// Tables of the bent skin.
const ARM: [&str; 2] = ["arm.csv", "arm.json"];

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

/// Statistics and distances of the curves, or what was predicted, as text tables.
#[must_use]
pub fn text(report: &CompareReport) -> String {
    let verdict = |ok| if ok { "ok" } else { "DIFFERS" };
    if !report.predicted.is_empty() {
        let inside = report.predicted.iter().filter(|row| row.inside).count();
        let table = Table::new("predicted", &report.predicted)
            .shown("session", |r| &r.session)
            .shown("statistic", |r| r.name)
            .shown("real", |r| r.real)
            .digits(5)
            .shown("twin", |r| r.twin)
            .digits(5)
            .shown("90 % of twins", |r| format!("{:.5} to {:.5}", r.low, r.high))
            .shown("", |r| if r.inside { "inside" } else { "OUTSIDE" });
        return format!("{}inside: {inside} of {}", table.text(), report.predicted.len());
    }
    let statistics = Table::new("compare", report.statistics.iter().chain(&report.not_modelled))
        .shown("session", |s| &s.session)
        .shown("statistic", |s| s.name)
        .shown("real", |s| with_error(s.real, s.real_standard_error, 5))
        .shown("twin", |s| with_error(s.twin, s.twin_standard_error, 5))
        .shown("tolerance", |s| s.tolerance)
        .shown("", move |s| s.ok.map_or("", verdict));
    let mut out = statistics.text();
    if !report.distances().is_empty() {
        let curves = Table::new("curves", report.distances())
            .shown("decoder", |c| short_label(c.decode))
            .shown("score", |c| c.metric)
            .shown("mean", |c| c.mean_abs_difference)
            .digits(4)
            .shown("largest", |c| c.max_abs_difference)
            .digits(4)
            .shown("allowed", |c| c.tolerance)
            .digits(2)
            .shown("", move |c| verdict(c.ok));
        out.push_str(&format!("\n|twin − real| over M = 7 … 100\n{}", curves.text()));
    }
    out.trim_end().to_owned()
}

/// The statistics of the bent skin as a text table.
#[must_use]
pub fn arm_text(report: &ArmReport) -> String {
    let table = Table::new("arm", &report.statistics)
        .shown("statistic", |b| b.statistic)
        .shown("unit", |b| b.unit)
        .shown("real", |b| b.real)
        .digits(3)
        .shown("twin", |b| b.twin)
        .digits(3)
        .shown("90 % band", |b| format!("{:.3} – {:.3}", b.low, b.high))
        .shown("", |b| if b.inside { "" } else { "outside" });
    format!(
        "{} ({} touches), twin: {} simulated bent skins (`spts simulate arm`)\n{}",
        report.session,
        report.touches,
        report.skins,
        table.text().trim_end()
    )
}

/// Writes the tables of the bent skin into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_arm(report: &ArmReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path(ARM[0]), &report.statistics)?;
        write_json(&out.path(ARM[1]), report)?;
        Ok(())
    })
}

/// Writes the tables and the figures of `report`, and of `objects` where there are any, into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &CompareReport, objects: Option<&PerObjectReport>, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        if !report.predicted.is_empty() {
            write_table(&out.path("predicted.csv"), &report.predicted)?;
            return Ok(());
        }
        write_table(&out.path("compare.csv"), &report.all_statistics())?;
        write_table(&out.path("curves.csv"), report.distances())?;
        let figures = out.folder("figures")?;
        draw(report, &figures)?;
        if let Some(objects) = objects {
            per_object::write_tables(objects, |name| out.path(name))?;
            per_object::draw(objects, &figures)?;
        }
        Ok(())
    })
}

/// Draws the figures of `report`, each as .svg and .png, into `folder`: `residuals`, `quantiles` and, with curves,
/// `scores`.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found.
pub fn draw(report: &CompareReport, folder: &Path) -> Result<(), FigureError> {
    draw_all(&report.compared, report.curves.as_ref(), folder)
}

/// Bins of a histogram, over ± [`REACH`].
const BINS: usize = 81;
/// Half width of a histogram, V.
const REACH: f64 = 1.2;
/// Quantiles of a residual in a quantile–quantile plot.
const POINTS: usize = 200;

/// Writes `residuals`, `quantiles` and, with curves, `scores` (.svg and .png) into `folder`.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found.
fn draw_all(compared: &[ComparedSession], curves: Option<&ScoreCurves>, folder: &Path) -> Result<(), FigureError> {
    let charts: Vec<Chart> = compared.iter().map(histogram).collect();
    save_charts(&charts, folder, "residuals")?;
    let charts: Vec<Chart> = compared.iter().map(quantile_plot).collect();
    save_charts(&charts, folder, "quantiles")?;
    let Some(curves) = curves else { return Ok(()) };
    let panels = [
        PublishedDecode::Matched,
        PublishedDecode::ScriptS20,
        PublishedDecode::ScriptM4,
    ];
    save_charts(&panels.map(|decode| scores(curves, decode)), folder, "scores")
}

/// Share of the residuals in each bin, logarithmic.
fn histogram(compared: &ComparedSession) -> Chart {
    let shares = |values: &[f64]| -> Vec<(f64, f64)> {
        let mut counts = vec![0.0; BINS];
        let width_v = 2.0 * REACH / BINS as f64;
        for v in values.iter().filter(|v| v.abs() < REACH) {
            #[expect(clippy::cast_possible_truncation, reason = "a bin's number")]
            let bin = ((v + REACH) / width_v) as usize;
            counts[bin.min(BINS - 1)] += 1.0 / values.len() as f64;
        }
        let middle_v = |bin: usize| (bin as f64 + 0.5) * width_v - REACH;
        counts
            .into_iter()
            .enumerate()
            .map(|(bin, share)| (middle_v(bin), share))
            .collect()
    };
    Chart {
        title: object_label(&compared.real.session).to_owned(),
        x_label: "residual without memory, V".to_owned(),
        y_label: "share of samples in a bin".to_owned(),
        y_log: true,
        series: vec![
            Series::new("real skin", Style::Real, 0, shares(&compared.real.clean_v)),
            Series::new("twin", Style::Twin, 0, shares(&compared.twin.clean_v)),
        ],
        ..Chart::default()
    }
}

/// Quantiles of the twin's output and residual against the skin's.
fn quantile_plot(compared: &ComparedSession) -> Chart {
    let (real, twin) = (&compared.real, &compared.twin);
    let pair = |r: &[f64], t: &[f64]| -> Vec<(f64, f64)> { r.iter().copied().zip(t.iter().copied()).collect() };
    let output = pair(&real.output_quantiles_v, &twin.output_quantiles_v);
    let ends = [output.first(), output.last()]
        .into_iter()
        .flatten()
        .map(|p| (p.0, p.0))
        .collect();
    let ten = |values: &[f64]| -> Vec<f64> { quantiles(values, POINTS).iter().map(|v| 10.0 * v).collect() };
    Chart {
        title: object_label(&compared.real.session).to_owned(),
        x_label: "quantile of the real skin, V".to_owned(),
        y_label: "quantile of the twin, V".to_owned(),
        series: vec![
            Series::new("equal", Style::Baseline, 0, ends),
            Series::new("output", Style::Twin, 0, output),
            Series::new(
                "residual × 10",
                Style::Raster,
                0,
                pair(&ten(&real.clean_v), &ten(&twin.clean_v)),
            ),
        ],
        ..Chart::default()
    }
}

fn scores(curves: &ScoreCurves, decode: PublishedDecode) -> Chart {
    let mut all = Vec::new();
    for (variant, (name, get)) in (0..).zip([
        ("support", (|r| r.support) as fn(&spts_eval::ScoreRow) -> f64),
        ("IoU", |r| r.iou),
        ("vote of 20", |r| r.class_vote20),
    ]) {
        for (style, whose, rows) in [
            (Style::Twin, "twin", &curves.twin),
            (Style::Real, "real skin", &curves.real),
        ] {
            let points = rows
                .iter()
                .filter(|r| r.decode == decode.name())
                .map(|r| (r.m as f64, get(r)));
            all.push(Series::new(
                format!("{whose}, {name}"),
                style,
                variant,
                points.collect(),
            ));
        }
    }
    Chart {
        title: label(decode.name()).to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: "score, mean over the objects".to_owned(),
        x_log: true,
        y_range: Some((0.0, 1.02)),
        series: all,
        ..Chart::default()
    }
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
