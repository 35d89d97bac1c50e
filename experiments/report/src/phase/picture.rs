//! Rates as heat maps under the theory's edge, and the crossings as curves beside it.

use crate::figures::{Chart, Series, Sheet, Style, Tile, TileRow};
use spts_studies::phase::{CELLS, Method, PhaseReport, Theory};

/// Heat maps side by side.
const ACROSS: usize = 3;
/// Side of a heat map, CSS pixels.
const TILE_PX: usize = 220;
/// Inks of the methods in a panel, told apart by colour, stroke and marker.
const INKS: [(Style, u8); 8] = [
    (Style::Real, 0),
    (Style::Twin, 0),
    (Style::Raster, 0),
    (Style::Twin, 1),
    (Style::Raster, 1),
    (Style::RasterReal, 0),
    (Style::Twin, 2),
    (Style::Raster, 2),
];
/// Points of a theoretical curve.
const CURVE: usize = 100;

/// Crossings over the undersampling: the methods that are told S, and those that weigh fit against a prior.
pub(super) fn charts(report: &PhaseReport) -> Vec<Chart> {
    let panel = |title: &str, told_sparsity: bool| {
        let shown: Vec<&Method> = report
            .methods
            .iter()
            .filter(|m| m.told_sparsity == told_sparsity)
            .collect();
        let mut series: Vec<Series> = shown
            .iter()
            .zip(INKS.iter().cycle())
            .map(|(method, (style, variant))| {
                let of = report.crossings.iter().filter(|c| c.method == method.name);
                let points = of.filter_map(|c| Some((c.delta, c.rho?))).collect();
                Series::new(method.name, *style, *variant, points)
            })
            .collect();
        let what = if report.positive { "x ≥ 0" } else { "either sign" };
        let weak = format!("theory: least sum, {what}");
        series.push(curve(&weak, Theory::Weak, Style::Paper, report));
        if shown.iter().any(|method| method.theory == Theory::Orthant) {
            series.push(curve("theory: any x ≥ 0", Theory::Orthant, Style::Baseline, report));
        }
        Chart {
            title: title.to_owned(),
            x_label: "undersampling M/N".to_owned(),
            y_label: "sparsity S/M, half solved".to_owned(),
            y_range: Some((0.0, 1.0)),
            series,
            ..Chart::default()
        }
    };
    [
        ("Methods that are told S", true),
        ("Methods that are not told S", false),
    ]
    .into_iter()
    .filter(|(_, told)| report.methods.iter().any(|m| m.told_sparsity == *told))
    .map(|(title, told)| panel(title, told))
    .collect()
}

/// A theory's curve.
fn curve(name: &str, theory: Theory, style: Style, report: &PhaseReport) -> Series {
    let deltas = (1..=CURVE).map(|i| i as f64 / CURVE as f64);
    let points = deltas.filter_map(|delta| Some((delta, theory.rho(delta, report.signs).ok()?)));
    Series::new(name, style, 0, points.collect())
}

/// One heat map a method: M/N to the right, S/M upwards, bright where all problems are solved, the cells below the
/// theory outlined.
pub(super) fn sheet(report: &PhaseReport) -> Sheet {
    let rows = report.methods.chunks(ACROSS).map(|methods| TileRow {
        label: String::new(),
        tiles: methods.iter().map(|method| tile(method, report)).collect(),
    });
    Sheet {
        title: format!(
            "Share of {} problems solved, N = {}: 0 dark, 1 bright. Right: M/N from {} to 1; up: S/M from 0 to 1. Outlined: below the theory",
            report.trials,
            report.unknowns,
            1.0 / CELLS as f64
        ),
        column_titles: Vec::new(),
        rows: rows.collect(),
        tile_px: TILE_PX,
    }
}

fn tile(method: &Method, report: &PhaseReport) -> Tile {
    let (mut values, mut outline) = (Vec::new(), Vec::new());
    for row in 0..CELLS {
        let rho = ((CELLS - row) as f64 - 0.5) / CELLS as f64;
        for column in 0..CELLS {
            let delta = (column + 1) as f64 / CELLS as f64;
            values.push(rate(method.name, delta, rho, report));
            outline.push(method.theory.rho(delta, report.signs).is_ok_and(|theory| rho < theory));
        }
    }
    Tile::Heat {
        values,
        rows: CELLS,
        cols: CELLS,
        max: Some(1.0),
        caption: method.name.to_owned(),
        outline: Some(outline),
    }
}

/// Rate at the measured point next to (`delta`, `rho`); not a number in a column that was left out.
fn rate(method: &str, delta: f64, rho: f64, report: &PhaseReport) -> f64 {
    let own = report.rates.iter().filter(|p| p.method == method);
    // half a cell, and the rounding of M to a whole number
    let reach = 0.5 / CELLS as f64 + 0.5 / report.unknowns as f64;
    let column = own.filter(|p| (p.delta - delta).abs() < reach);
    let away = |p: f64| (p - rho).abs();
    column
        .min_by(|a, b| away(a.rho).total_cmp(&away(b.rho)))
        .map_or(f64::NAN, |p| p.rate)
}
