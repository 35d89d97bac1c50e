//! Figures as files: the SVG text of a canvas, and the pixels that are painted from that text.
//!
//! The text of pixels is set in a font that is part of the program (Inter, in `assets`): a figure has the same bytes on
//! every machine.

use super::canvas::Canvas;
use png::{ColorType, DeflateCompression, Encoder, Filter};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};
use spts::output::{OutputError, write_bytes};
use std::io;
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// PNG pixels to the CSS pixel.
pub const PIXELS_PER_UNIT: f64 = 2.0;
/// Longest side of a PNG file, pixels.
const MOST_PIXELS: usize = 1 << 15;
/// Effort of the compression. Figures are plain areas and text: level 1 takes a fifth of the time of the usual level 6,
/// and the files are 1.4 to 2 times as large.
const EFFORT: u8 = 1;
/// What a pixel is compared with: the one above, which in a figure is mostly the same. Trying every kind of filter on
/// every row takes as long as compressing it and saves 2 % of a figure.
const FILTER: Filter = Filter::Up;

/// How SVG is painted: with our own fonts, and none of the machine's.
static PAINTING: LazyLock<Options<'static>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_data(include_bytes!("../../assets/Inter-Regular.otf").to_vec());
    fonts.load_font_data(include_bytes!("../../assets/Inter-Bold.otf").to_vec());
    Options {
        font_family: "Inter".to_owned(),
        fontdb: Arc::new(fonts),
        ..Options::default()
    }
});

/// Writes a figure to `dir/name.svg` and `dir/name.png`. The folder is made if it is missing.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn save(canvas: &Canvas, dir: &Path, name: &str) -> Result<(), OutputError> {
    std::fs::create_dir_all(dir).map_err(OutputError::write(dir))?;
    write_bytes(&dir.join(format!("{name}.svg")), canvas.svg().as_bytes())?;
    save_png(canvas, &dir.join(format!("{name}.png")))
}

/// Writes a figure as PNG.
///
/// # Errors
/// [`OutputError`] when the file cannot be written.
pub fn save_png(canvas: &Canvas, path: &Path) -> Result<(), OutputError> {
    write_bytes(path, &png_of(canvas).map_err(OutputError::write(path))?)
}

/// A figure as the bytes of a PNG file.
///
/// # Errors
/// When the figure cannot be painted.
pub fn png_of(canvas: &Canvas) -> io::Result<Vec<u8>> {
    let (width, height, rgb) = paint(canvas)?;
    encode_png(&rgb, width, height)
}

/// Paints the figure. Returns width, height and RGB pixels.
///
/// # Errors
/// When the figure is too large for the memory.
pub fn paint(canvas: &Canvas) -> io::Result<(usize, usize, Vec<u8>)> {
    let side = |value: f64| index(value * PIXELS_PER_UNIT, MOST_PIXELS).max(1);
    let (width, height) = (side(canvas.width), side(canvas.height));
    let tree = Tree::from_str(&canvas.svg(), &PAINTING).map_err(io::Error::other)?;
    let pixels = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let mut pixmap = Pixmap::new(pixels(width), pixels(height)).ok_or(io::ErrorKind::OutOfMemory)?;
    #[expect(clippy::cast_possible_truncation, reason = "2 is exact")]
    let scale = PIXELS_PER_UNIT as f32;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    // every pixel is opaque: the figure stands on white
    let rgb = pixmap
        .data()
        .chunks_exact(4)
        .flat_map(|rgba| [rgba[0], rgba[1], rgba[2]]);
    Ok((width, height, rgb.collect()))
}

/// An RGB picture as the bytes of a PNG file.
///
/// # Errors
/// When the picture does not fill its size.
pub fn encode_png(rgb: &[u8], width: usize, height: usize) -> io::Result<Vec<u8>> {
    if rgb.len() != width * height * 3 || rgb.is_empty() {
        let len = rgb.len();
        return Err(io::Error::other(format!(
            "{len} values do not fill {height} × {} cells",
            width * 3
        )));
    }
    let side = |value: usize| u32::try_from(value).map_err(io::Error::other);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, side(width)?, side(height)?);
    encoder.set_color(ColorType::Rgb);
    encoder.set_deflate_compression(DeflateCompression::Level(EFFORT));
    encoder.set_filter(FILTER);
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(bytes)
}

/// A pixel index of a coordinate, clamped to `0..=limit`.
#[expect(clippy::cast_possible_truncation, reason = "clamped to a picture's size")]
pub(super) fn index(value: f64, limit: usize) -> usize {
    if value > 0.0 { (value as usize).min(limit) } else { 0 }
}

/// A picture at another size: the mean over the source pixels under each new one.
#[must_use]
pub fn resample(rgb: &[u8], (width, height): (usize, usize), (w, h): (usize, usize)) -> Vec<u8> {
    let mut out = Vec::with_capacity(w * h * 3);
    if rgb.len() != width * height * 3 || rgb.is_empty() {
        return vec![255; w * h * 3];
    }
    let range = |i: usize, new: usize, old: usize| {
        let from = (i * old / new).min(old - 1);
        from..((i + 1) * old / new).clamp(from + 1, old)
    };
    for y in 0..h {
        for x in 0..w {
            let (mut sum, mut count) = ([0_usize; 3], 0);
            for v in range(y, h, height) {
                for u in range(x, w, width) {
                    let start = (v * width + u) * 3;
                    sum.iter_mut()
                        .zip(&rgb[start..start + 3])
                        .for_each(|(sum, &part)| *sum += usize::from(part));
                    count += 1;
                }
            }
            out.extend(sum.map(|part| u8::try_from((part + count / 2) / count).unwrap_or(u8::MAX)));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_averages_and_growing_repeats() {
        let two = [10, 20, 30, 30, 40, 50];
        assert_eq!(resample(&two, (2, 1), (1, 1)), [20, 30, 40]);
        assert_eq!(
            resample(&two, (2, 1), (4, 1)),
            [10, 20, 30, 10, 20, 30, 30, 40, 50, 30, 40, 50]
        );
        assert_eq!(resample(&[], (0, 0), (1, 1)), [255; 3]);
    }

    /// The pixels of text are ours alone: these are the same on every machine.
    #[test]
    fn pixels_do_not_depend_on_the_machine() {
        let mut canvas = Canvas::new(200.0, 40.0, "");
        let style = super::super::canvas::TextStyle::new(14.0, super::super::colour::INK);
        canvas.text((4.0, 10.0), "Φ·x = 0.5 µs ± 10⁻⁴, M ≥ 20", style);
        canvas.text((4.0, 30.0), "bold", style.bold());
        let (width, height, rgb) = paint(&canvas).unwrap();
        assert_eq!((width, height), (400, 80));
        // FNV-1a
        let hash = rgb.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
            (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        assert_eq!(hash, 0x949b_63ad_3925_b1b5, "{hash:#x}");
    }
}
