//! Coherence and IoU as curves, and the matrices themselves.

use super::set::SeedSet;
use super::study::Outcome;
use crate::figures::{Arm, Chart, Series, Sheet, Tile, TileRow};

/// Inks of the sets: the given one, mixed addresses, searched seeds.
const ARMS: [Arm; 3] = [Arm::Raster, Arm::Twin, Arm::Baseline];
/// Rows of the matrices that are drawn.
const MATRIX_ROWS: usize = 100;
/// Side of a matrix, CSS pixels.
const TILE_PX: usize = 320;

/// Coherence of rows over M, and IoU over M for each kind of images and noise.
pub(super) fn charts(outcome: &Outcome) -> Vec<Chart> {
    let shown = || outcome.sets.iter().zip(ARMS);
    let coherence = shown().flat_map(|(set, arm)| {
        let of = |get: fn(&super::WindowRow) -> f64| {
            let own = outcome.windows.iter().filter(|w| w.seeds == set.name);
            own.map(|w| (w.m as f64, get(w))).collect()
        };
        [
            Series::new(
                format!("{}, worst window", set.name),
                arm,
                0,
                of(|w| w.row_coherence_worst),
            ),
            Series::new(format!("{}, mean", set.name), arm, 1, of(|w| w.row_coherence)),
        ]
    });
    let mut charts = vec![Chart {
        title: "Largest coherence of two rows of a window".to_owned(),
        x_label: "rows M".to_owned(),
        y_label: "coherence".to_owned(),
        x_log: true,
        y_range: Some((0.0, 1.0)),
        series: coherence.collect(),
        ..Chart::default()
    }];
    let mut panels: Vec<(&str, f64)> = outcome.worth.iter().map(|w| (w.images, w.noise)).collect();
    panels.dedup();
    charts.extend(panels.into_iter().map(|(images, noise)| iou(images, noise, outcome)));
    charts
}

/// IoU over M of every set and decoder.
fn iou(images: &'static str, noise: f64, outcome: &Outcome) -> Chart {
    let rows = || {
        let own = outcome.worth.iter();
        own.filter(move |w| w.images == images && w.noise.to_bits() == noise.to_bits())
    };
    let mut decoders: Vec<&str> = rows().map(|w| w.decoder).collect();
    decoders.dedup();
    let mut series = Vec::new();
    for (variant, decoder) in (0..).zip(decoders) {
        for (set, arm) in outcome.sets.iter().zip(ARMS) {
            let own = rows().filter(|w| w.seeds == set.name && w.decoder == decoder);
            let points = own.map(|w| (w.m as f64, w.iou)).collect();
            series.push(Series::new(format!("{}, {decoder}", set.name), arm, variant, points));
        }
    }
    Chart {
        title: format!("IoU, {images} images, noise {noise} of the image's norm"),
        x_label: "measurements M".to_owned(),
        y_label: "IoU".to_owned(),
        series,
        ..Chart::default()
    }
}

/// The first rows of every set: dark −1, bright +1.
pub(super) fn matrices(outcome: &Outcome) -> Sheet {
    let tile = |set: &SeedSet| {
        let rows = set.rows(outcome.mode, 0, MATRIX_ROWS);
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
            tiles: outcome.sets.iter().map(tile).collect(),
        }],
        tile_px: TILE_PX,
    }
}
