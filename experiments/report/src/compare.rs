//! The files of a comparison of the twin with recordings.

use crate::figures::{Chart, Curve, Plot, Series, Style, save_charts};
use crate::labels::{object_label, score_label, statistic_label};
use crate::per_object::{banded, marked};
use crate::{per_object, write_all_or_none};
use serde::Serialize;
use spts::output::{OutputFolder, write_json};
use spts_eval::decoders::{label, short_label};
use spts_eval::{ScoreRow, Table};
use spts_input::Refusal;
use spts_studies::arm::{ArmBand, ArmReport};
use spts_studies::calibrate::quantiles;
use spts_studies::compare::{
    CompareReport, ComparedSession, CurveDistance, PredictedStatistic, ScoreCurves, Statistic,
};
use spts_studies::per_object::PerObjectReport;
use std::path::Path;

/// Tables of the bent skin.
const ARM: [&str; 2] = ["arm.csv", "arm.json"];

/// A value with its standard error; a dash if it is undefined, such as the share of unexplained outliers when there are
/// no outliers.
pub(crate) fn with_error(value: f64, error: Option<f64>, digits: usize) -> String {
    match error {
        _ if value.is_nan() => "–".to_owned(),
        Some(error) if !error.is_nan() => format!("{value:.digits$} ± {error:.digits$}"),
        _ => format!("{value:.digits$}"),
    }
}

/// Statistics that are compared, or of what is not modelled.
pub(crate) fn statistics<'a>(rows: impl IntoIterator<Item = &'a Statistic>) -> Table<'a, &'a Statistic> {
    Table::new("compare", rows)
        .named("session", "session", |s| s.session.as_str(), object_label)
        .named("name", "statistic", |s| s.name, statistic_label)
        .file("real", |s| s.real)
        .file("real_standard_error", |s| s.real_standard_error)
        .shown("real skin", |s| with_error(s.real, s.real_standard_error, 5))
        .file("twin", |s| s.twin)
        .file("twin_standard_error", |s| s.twin_standard_error)
        .shown("twin", |s| with_error(s.twin, s.twin_standard_error, 5))
        .column("tolerance", "allowed difference", |s| s.tolerance)
        .named("ok", "", |s| s.ok, |ok| ok.map_or("", verdict))
}

fn verdict(ok: bool) -> &'static str {
    if ok { "ok" } else { "DIFFERS" }
}

/// How far the score curves of skin and twin are from each other.
pub(crate) fn curves(report: &CompareReport) -> Table<'_, &CurveDistance> {
    Table::new("curves", report.distances())
        .named("metric", "score", |c| c.metric, score_label)
        .named("decode", "decoder", |c| c.decode, short_label)
        .column("mean_abs_difference", "mean |twin − real|", |c| c.mean_abs_difference)
        .digits(4)
        .column("max_abs_difference", "largest", |c| c.max_abs_difference)
        .digits(4)
        .column("tolerance", "mean allowed", |c| c.tolerance)
        .digits(2)
        .named("ok", "", |c| c.ok, verdict)
}

fn predicted(report: &CompareReport) -> Table<'_, &PredictedStatistic> {
    let table = Table::new("predicted", &report.predicted)
        .named("session", "session", |r| r.session.as_str(), object_label)
        .named("name", "statistic", |r| r.name, statistic_label);
    marked(banded(table, 5, |r| r.of), |r| r.of)
}

/// The statistics of the bent skin.
fn arm(report: &ArmReport) -> Table<'_, &ArmBand> {
    let table = Table::new("arm", &report.statistics).column("statistic", "statistic", |b| b.statistic).column(
        "unit",
        "unit",
        |b| b.unit,
    );
    marked(banded(table, 3, |b| b.of), |b| b.of)
}

/// What `--json` prints.
pub fn json<'a>(report: &'a CompareReport, objects: Option<&'a PerObjectReport>) -> impl Serialize + 'a {
    #[derive(Serialize)]
    struct Printed<'a> {
        statistics: Table<'a, &'a Statistic>,
        curves: Table<'a, &'a CurveDistance>,
        #[serde(skip_serializing_if = "Option::is_none")]
        predicted: Option<Table<'a, &'a PredictedStatistic>>,
        not_modelled: Table<'a, &'a Statistic>,
        #[serde(skip_serializing_if = "Option::is_none")]
        per_object: Option<per_object::Printed<'a>>,
    }
    Printed {
        statistics: statistics(&report.statistics),
        curves: curves(report),
        predicted: (!report.predicted.is_empty()).then(|| predicted(report)),
        not_modelled: statistics(&report.not_modelled),
        per_object: objects.map(per_object::json),
    }
}

/// Statistics and distances of the curves, or what was predicted, as text tables.
pub fn text(report: &CompareReport) -> String {
    if !report.predicted.is_empty() {
        let inside = report.predicted.iter().filter(|row| row.of.inside() == Some(true)).count();
        let judged = report.predicted.iter().filter(|row| row.of.inside().is_some()).count();
        return format!("{}inside: {inside} of {judged}", predicted(report).text());
    }
    let mut out = statistics(report.all_statistics()).text();
    if !report.distances().is_empty() {
        out.push_str(&format!("\nscore curves over M = 7 … 100\n{}", curves(report).text()));
    }
    out.trim_end().to_owned()
}

/// The statistics of the bent skin as a text table.
pub fn arm_text(report: &ArmReport) -> String {
    format!(
        "{} ({} touches), twin: {} simulated bent skins (`spts simulate arm`)\n{}",
        report.session,
        report.touches,
        report.skins,
        arm(report).text().trim_end()
    )
}

/// What `--arm --json` prints.
pub fn arm_json(report: &ArmReport) -> impl Serialize + '_ {
    #[derive(Serialize)]
    struct Printed<'a> {
        session: &'a str,
        touches: usize,
        skins: u64,
        statistics: Table<'a, &'a ArmBand>,
    }
    Printed { session: &report.session, touches: report.touches, skins: report.skins, statistics: arm(report) }
}

/// Writes the tables of the bent skin into the folder `out`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_arm(report: &ArmReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        arm(report).write(out)?;
        write_json(&out.path(ARM[1]), &arm_json(report))
    })
}

/// Writes the tables and the figures of `report`, and of `objects` where there are any, into the folder `out`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &CompareReport, objects: Option<&PerObjectReport>, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        if !report.predicted.is_empty() {
            return predicted(report).write(out);
        }
        statistics(report.all_statistics()).write(out)?;
        curves(report).write(out)?;
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
/// [`Refusal`] when a file cannot be written or no font is found.
pub fn draw(report: &CompareReport, folder: &Path) -> Result<(), Refusal> {
    let charts: Vec<Chart> = report.compared.iter().map(histogram).collect();
    save_charts(&charts, folder, "residuals")?;
    let charts: Vec<Chart> = report.compared.iter().map(quantile_plot).collect();
    save_charts(&charts, folder, "quantiles")?;
    let Some(curves) = &report.curves else { return Ok(()) };
    let panels = ["matched", "script_s20", "script_m4"];
    save_charts(&panels.map(|decode| scores(curves, decode)), folder, "scores")
}

/// Bins of a histogram, over ± [`REACH`].
const BINS: usize = 81;
/// Half width of a histogram, V.
const REACH: f64 = 1.2;
/// Quantiles of a residual in a quantile–quantile plot.
const POINTS: usize = 200;

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
        counts.into_iter().enumerate().map(|(bin, share)| (middle_v(bin), share)).collect()
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
    let ends = [output.first(), output.last()].into_iter().flatten().map(|p| (p.0, p.0)).collect();
    let ten = |values: &[f64]| -> Vec<f64> { quantiles(values, POINTS).iter().map(|v| 10.0 * v).collect() };
    Chart {
        title: object_label(&compared.real.session).to_owned(),
        x_label: "quantile of the real skin, V".to_owned(),
        y_label: "quantile of the twin, V".to_owned(),
        series: vec![
            Series::new("equal", Style::Baseline, 0, ends),
            Series::new("output", Style::Twin, 0, output),
            Series::new("residual × 10", Style::Raster, 0, pair(&ten(&real.clean_v), &ten(&twin.clean_v))),
        ],
        ..Chart::default()
    }
}

fn scores(curves: &ScoreCurves, decode: &str) -> Chart {
    type Score = (u8, &'static str, fn(&ScoreRow) -> f64);
    let all: [Score; 3] = [(0, "support", |r| r.support), (1, "IoU", |r| r.iou), (2, "vote of 20", |r| r.class_vote20)];
    let skins = [(Style::Twin, "twin", &curves.twin), (Style::Real, "real skin", &curves.real)];
    let mut rows = Vec::new();
    for score in &all {
        for (style, whose, of_skin) in skins {
            let here = of_skin.iter().filter(|r| r.decode == decode);
            rows.extend(here.map(|r| (score, style, whose, r)));
        }
    }
    Plot::new(rows)
        .x("measurements M", |(.., r)| r.m as f64)
        .log_x()
        .y("score, mean over the objects", |((_, _, get), .., r)| get(r))
        .within(0.0, 1.02)
        .by(|((variant, name, _), style, whose, _)| Curve::new(format!("{whose}, {name}"), style, *variant))
        .chart(label(decode))
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
