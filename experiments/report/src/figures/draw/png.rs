//! Pictures as PNG files.

use crate::figures::error::FigureError;
use png::{ColorType, DeflateCompression, Encoder, Filter};
use std::path::Path;

/// Effort of the compression. Figures are plain areas and text: level 1 takes a fifth of the time of the usual level 6,
/// and the files are 1.4 to 2 times as large.
const EFFORT: u8 = 1;
/// What a pixel is compared with: the one above, which in a figure is mostly the same. Trying every kind of filter on
/// every row takes as long as compressing it and saves 2 % of a figure.
const FILTER: Filter = Filter::Up;

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
    let mut encoder = Encoder::new(&mut bytes, side(width)?, side(height)?);
    encoder.set_color(ColorType::Rgb);
    encoder.set_deflate_compression(DeflateCompression::Level(EFFORT));
    encoder.set_filter(FILTER);
    let encoded = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(rgb));
    encoded.map_err(|error| failed(error.to_string()))?;
    Ok(bytes)
}
