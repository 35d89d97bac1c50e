//! Pictures as PNG files.

use crate::figures::error::FigureError;
use plotters::backend::{BitMapBackend, DrawingBackend as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

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
pub(super) fn write_png(rgb: &[u8], width: usize, height: usize, file: &Path, path: &Path) -> Result<(), FigureError> {
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

/// A hidden name beside `path` that no other writer uses.
pub(super) fn temporary(path: &Path, extension: &str) -> PathBuf {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{serial}.{extension}", std::process::id()))
}
