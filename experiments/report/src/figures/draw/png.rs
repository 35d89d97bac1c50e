//! Pictures as PNG files.

use crate::figures::error::FigureError;
use std::path::Path;

/// An RGB picture as the bytes of a PNG file; `path` is the file they are for, named in errors.
///
/// # Errors
/// [`FigureError`] when the picture does not fill its size.
pub fn encode_png(rgb: &[u8], width: usize, height: usize, path: &Path) -> Result<Vec<u8>, FigureError> {
    if rgb.len() != width * height * 3 || rgb.is_empty() {
        return Err(FigureError::Shape {
            path: path.to_owned(),
            len: rgb.len(),
            rows: height,
            cols: width * 3,
        });
    }
    let failed = |reason: String| FigureError::Paint {
        path: path.to_owned(),
        reason,
    };
    let side = |value: usize| u32::try_from(value).map_err(|error| failed(error.to_string()));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side(width)?, side(height)?);
    encoder.set_color(png::ColorType::Rgb);
    let encoded = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(rgb));
    encoded.map_err(|error| failed(error.to_string()))?;
    Ok(bytes)
}
