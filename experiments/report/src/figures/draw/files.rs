//! Files, written whole or not at all.

use super::canvas::Canvas;
use super::paint::paint;
use super::svg::svg;
use crate::figures::error::FigureError;
use plotters::backend::{BitMapBackend, DrawingBackend as _};
use spts::output::write_bytes;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

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
    let temporary = temporary(path, "png");
    write_png(&rgb, width, height, &temporary, path)?;
    rename(&temporary, path)
}

/// An RGB picture as the bytes of a PNG file. The encoder writes to disk only, so the bytes pass through the
/// system's temporary folder; `path` is the file they are for, named in errors.
///
/// # Errors
/// [`FigureError`] when the picture does not fill its size or the temporary file cannot be written.
pub fn encode_png(rgb: &[u8], width: usize, height: usize, path: &Path) -> Result<Vec<u8>, FigureError> {
    let file = temporary(&std::env::temp_dir().join("spts-figure"), "png");
    write_png(rgb, width, height, &file, path)?;
    let bytes = std::fs::read(&file);
    let _ = std::fs::remove_file(&file);
    bytes.map_err(|source| FigureError::Io { path: file, source })
}

/// Encodes a picture to `file`; errors name `path`, the file it is for.
fn write_png(rgb: &[u8], width: usize, height: usize, file: &Path, path: &Path) -> Result<(), FigureError> {
    if rgb.len() != width * height * 3 || rgb.is_empty() {
        return Err(FigureError::Shape {
            path: path.to_owned(),
            len: rgb.len(),
            rows: height,
            cols: width * 3,
        });
    }
    let failed = |reason: String| {
        let _ = std::fs::remove_file(file);
        FigureError::Paint {
            path: path.to_owned(),
            reason,
        }
    };
    let side = |value: usize| u32::try_from(value).map_err(|error| failed(error.to_string()));
    let size = (side(width)?, side(height)?);
    let mut backend = BitMapBackend::new(file, size);
    backend
        .blit_bitmap((0, 0), size, rgb)
        .map_err(|error| failed(error.to_string()))?;
    backend.present().map_err(|error| failed(error.to_string()))
}

/// Makes the folder of a file.
fn make_parent(path: &Path) -> Result<(), FigureError> {
    let parent = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(|source| FigureError::Io {
        path: parent.to_owned(),
        source,
    })
}

/// A hidden name beside `path` that no other writer uses.
fn temporary(path: &Path, extension: &str) -> PathBuf {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{serial}.{extension}", std::process::id()))
}

/// Moves a finished file into place.
fn rename(from: &Path, to: &Path) -> Result<(), FigureError> {
    std::fs::rename(from, to).map_err(|source| {
        let _ = std::fs::remove_file(from);
        FigureError::Io {
            path: to.to_owned(),
            source,
        }
    })
}
