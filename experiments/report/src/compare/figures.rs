//! Residuals, quantiles and score curves, real beside twin.

use crate::figures::{Chart, FigureError, Series, Style, save_charts};
use crate::labels::object_label;
use spts_eval::decoders::{PublishedDecode, label};
use spts_studies::calibrate::quantiles;
use spts_studies::compare::{ComparedSession, ScoreCurves};
use std::path::Path;

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
pub(super) fn draw(
    compared: &[ComparedSession],
    curves: Option<&ScoreCurves>,
    folder: &Path,
) -> Result<(), FigureError> {
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
