//! The list of shapes as pixels.

use super::canvas::{Anchor, Canvas, Shape, TextStyle};
use super::fill::{Pixels, index};
use super::text::HALF_CAPITAL_EM;
use crate::figures::colour::Rgb;
use crate::figures::error::FigureError;
use plotters::backend::{BitMapBackend, DrawingBackend as _};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontDesc, FontFamily, FontStyle, FontTransform, IntoTextStyle as _, RGBColor};
use std::path::Path;

/// PNG pixels to the CSS pixel.
pub const PIXELS_PER_UNIT: f64 = 2.0;
/// Face of the painted text; the font library falls back to the system's sans-serif.
const FACE: FontFamily<'static> = FontFamily::Name("DejaVu Sans");
/// What plotters calls the size of a font, in em.
const PLOTTERS_SIZE_EM: f64 = 1.24;
/// From the top of the box that plotters aligns to the base line, in em.
const BASE_LINE_EM: f64 = 0.76;

/// Paints the figure. Returns width, height and RGB pixels; `path` is the file they are for, named in errors.
///
/// # Errors
/// [`FigureError::Paint`] when no font is found.
pub fn paint(canvas: &Canvas, path: &Path) -> Result<(usize, usize, Vec<u8>), FigureError> {
    let scale = |value: f64| value * PIXELS_PER_UNIT;
    let at = |(x, y): (f64, f64)| (scale(x), scale(y));
    let size = |value: f64| index(scale(value), 1 << 15).max(1);
    let mut pixels = Pixels::new(size(canvas.width), size(canvas.height));
    for item in &canvas.items {
        match item {
            Shape::Polygon { points, fill, opacity } => {
                pixels.polygon(&points.iter().map(|&p| at(p)).collect::<Vec<_>>(), *fill, *opacity);
            }
            Shape::Disc { centre, radius, fill } => pixels.disc(at(*centre), scale(*radius), *fill),
            Shape::Line {
                points,
                stroke,
                width,
                dash,
            } => {
                let points: Vec<_> = points.iter().map(|&p| at(p)).collect();
                pixels.stroke(&points, *stroke, scale(*width), dash.map(at));
            }
            Shape::Picture {
                at: corner,
                size,
                width,
                height,
                rgb,
            } => {
                let (x, y) = at(*corner);
                blit(&mut pixels, (x.round(), y.round()), (rgb, *width, *height), at(*size));
            }
            Shape::Text { .. } => {}
        }
    }
    let Pixels { width, height, mut rgb } = pixels;
    write_texts(canvas, (width, height), &mut rgb).map_err(|reason| FigureError::Paint {
        path: path.to_owned(),
        reason,
    })?;
    Ok((width, height, rgb))
}

/// Paints all texts.
fn write_texts(canvas: &Canvas, (width, height): (usize, usize), rgb: &mut [u8]) -> Result<(), String> {
    let size = |value: usize| u32::try_from(value).map_err(|error| error.to_string());
    let mut backend = BitMapBackend::with_buffer(rgb, (size(width)?, size(height)?));
    for item in &canvas.items {
        let Shape::Text { at, text, style } = item else {
            continue;
        };
        let TextStyle {
            size,
            bold,
            colour: Rgb(r, g, b),
            anchor,
            upwards,
        } = *style;
        let em = size * PIXELS_PER_UNIT;
        let face = if bold { FontStyle::Bold } else { FontStyle::Normal };
        let mut font = FontDesc::new(FACE, em * PLOTTERS_SIZE_EM, face);
        let above = em * (BASE_LINE_EM - HALF_CAPITAL_EM);
        let (mut x, mut y) = (at.0 * PIXELS_PER_UNIT, at.1 * PIXELS_PER_UNIT);
        if upwards {
            font = font.transform(FontTransform::Rotate270);
            x -= above;
        } else {
            y -= above;
        }
        let side = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let look = font
            .color(&RGBColor(r, g, b).to_rgba())
            .into_text_style(&backend.get_size());
        let look = look.pos(Pos::new(side, VPos::Top));
        backend
            .draw_text(text, &look, (whole(x), whole(y)))
            .map_err(|error| error.to_string())?;
    }
    backend.present().map_err(|error| error.to_string())
}

/// Nearest pixel coordinate.
#[expect(clippy::cast_possible_truncation, reason = "saturates, and is then off the picture")]
fn whole(value: f64) -> i32 {
    value.round() as i32
}

/// Stretches a picture over a rectangle.
fn blit(pixels: &mut Pixels, corner: (f64, f64), (rgb, width, height): (&[u8], usize, usize), size: (f64, f64)) {
    let (x0, y0) = (index(corner.0, pixels.width), index(corner.1, pixels.height));
    let w = index(size.0.round(), pixels.width - x0);
    let h = index(size.1.round(), pixels.height - y0);
    let scaled = resample(rgb, (width, height), (w, h));
    for (y, row) in scaled.chunks_exact((w * 3).max(1)).enumerate() {
        let start = ((y0 + y) * pixels.width + x0) * 3;
        if let Some(target) = pixels.rgb.get_mut(start..start + w * 3) {
            target.copy_from_slice(row);
        }
    }
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

/// A picture no larger than `limit`, in pixels: its width, height and RGB.
pub(super) fn shrink(rgb: &[u8], (width, height): (usize, usize), limit: (f64, f64)) -> (usize, usize, Vec<u8>) {
    let w = index(limit.0.round(), width).max(1);
    let h = index(limit.1.round(), height).max(1);
    (w, h, resample(rgb, (width, height), (w, h)))
}

#[cfg(test)]
mod tests {
    use super::resample;

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
}
