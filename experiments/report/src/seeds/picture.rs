//! Coherence and IoU as curves, and the matrices themselves.

use crate::figures::{Chart, Series, Sheet, Style, Tile, TileRow};
use spts_studies::seeds::{SeedReport, SeedSet};

/// Inks of the sets: the given one, mixed addresses, searched seeds, bytes.
const ARMS: [Style; 4] = [Style::Raster, Style::Twin, Style::Baseline, Style::Real];
/// Rows of the matrices that are drawn.
const MATRIX_ROWS: usize = 100;
/// Side of a matrix, CSS pixels.
const TILE_PX: usize = 280;

/// Coherence of rows over M, and IoU over M for each kind of images and decoder, at the largest noise.
pub(super) fn charts(report: &SeedReport) -> Vec<Chart> {
    let mut charts = vec![Chart {
        title: "Most alike rows, worst window".to_owned(),
        x_label: "rows M".to_owned(),
        y_label: "coherence".to_owned(),
        x_log: true,
        y_range: Some((0.0, 1.0)),
        series: each_set(report, &|set| {
            let own = report.windows.iter().filter(|w| w.seeds == set.name);
            own.map(|w| (w.m as f64, w.row_coherence_worst)).collect()
        }),
        ..Chart::default()
    }];
    let noise = report.worth.iter().map(|w| w.noise).fold(0.0, f64::max);
    let noisy = || report.worth.iter().filter(move |w| w.noise >= noise);
    let mut panels: Vec<(&str, &str)> = noisy().map(|w| (w.images, w.decoder)).collect();
    panels.dedup();
    charts.extend(panels.into_iter().map(|(images, decoder)| Chart {
        title: format!("{images} images, {decoder}, noise {noise}"),
        x_label: "measurements M".to_owned(),
        y_label: "IoU".to_owned(),
        series: each_set(report, &|set| {
            let own = noisy().filter(|w| w.seeds == set.name && w.images == images && w.decoder == decoder);
            own.map(|w| (w.m as f64, w.iou)).collect()
        }),
        ..Chart::default()
    }));
    charts
}

/// A curve for every set, in its own ink.
fn each_set(report: &SeedReport, points: &dyn Fn(&SeedSet) -> Vec<(f64, f64)>) -> Vec<Series> {
    let shown = report.sets.iter().zip(ARMS);
    shown
        .map(|(set, style)| Series::new(set.name.as_str(), style, 0, points(set)))
        .collect()
}

/// The first rows of every set: dark −1, bright +1.
pub(super) fn matrices(report: &SeedReport) -> Sheet {
    let tile = |set: &SeedSet| {
        let rows = set.rows(report.mode, 0, MATRIX_ROWS);
        Tile::Heat {
            values: rows.view().values().iter().map(|level| 0.5 * (level + 1.0)).collect(),
            rows: MATRIX_ROWS,
            cols: set.seeds.len(),
            max: Some(1.0),
            caption: set.name.clone(),
            outline: None,
        }
    };
    Sheet {
        title: format!("First {MATRIX_ROWS} rows of the sensing matrix, taxels to the right"),
        column_titles: Vec::new(),
        rows: vec![TileRow {
            label: String::new(),
            tiles: report.sets.iter().map(tile).collect(),
        }],
        tile_px: TILE_PX,
    }
}
