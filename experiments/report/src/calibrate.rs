//! Picture of `spts calibrate --skin`.

use crate::ReportError;
use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use spts_studies::calibrate::SkinReport;
use std::path::Path;

/// Side of a picture, CSS pixels.
const TILE_PX: usize = 240;

/// Writes pictures of the gains and of what is not known of them beside the file `path`, with its name: `.svg` and
/// `.png`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_gains(report: &SkinReport, path: &Path) -> Result<(), ReportError> {
    let [rows, cols] = report.shape;
    let tile = |values: Vec<f64>, what: &str| {
        let (least, most) = values
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), &v| (low.min(v), high.max(v)));
        Tile::Heat {
            values,
            rows,
            cols,
            max: None,
            caption: format!("{what}: {least:.2} to {most:.2}"),
            outline: None,
        }
    };
    let gains = report.skin.gains.log_mean.iter().map(|log| log.exp()).collect();
    let known = report.bands().map(|factor| factor - 1.0).collect();
    let sheet = Sheet {
        title: "Gains of the taxels".to_owned(),
        column_titles: vec!["gain".to_owned(), "not known".to_owned()],
        rows: vec![TileRow {
            label: String::new(),
            tiles: vec![tile(gains, "gain"), tile(known, "90 % band, relative")],
        }],
        tile_px: TILE_PX,
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    save_sheet(&sheet, path.parent().unwrap_or(Path::new("")), &name)?;
    Ok(())
}
