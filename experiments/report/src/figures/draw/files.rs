//! Files, written whole or not at all.

use super::canvas::Canvas;
use super::paint::paint;
use super::png::encode_png;
use super::svg::svg;
use crate::figures::error::FigureError;
use spts::output::write_bytes;
use std::path::Path;

/// Writes a figure to `dir/name.svg` and `dir/name.png`. The folder is made if it is missing.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found for the PNG.
pub fn save(canvas: &Canvas, dir: &Path, name: &str) -> Result<(), FigureError> {
    let path = dir.join(format!("{name}.svg"));
    make_parent(&path)?;
    write_bytes(&path, svg(canvas, &path)?.as_bytes())?;
    save_png(canvas, &dir.join(format!("{name}.png")))
}

/// Writes a figure as PNG.
///
/// # Errors
/// [`FigureError`] when the file cannot be written or no font is found.
pub fn save_png(canvas: &Canvas, path: &Path) -> Result<(), FigureError> {
    let (width, height, rgb) = paint(canvas, path)?;
    make_parent(path)?;
    Ok(write_bytes(path, &encode_png(&rgb, width, height, path)?)?)
}

/// Makes the folder of a file.
fn make_parent(path: &Path) -> Result<(), FigureError> {
    let parent = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|source| FigureError::Io {
        path: parent.to_owned(),
        source,
    })
}
