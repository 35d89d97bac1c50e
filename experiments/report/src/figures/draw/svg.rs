//! The list of shapes as SVG 1.1.

use super::canvas::{Anchor, Canvas, Point, Shape};
use super::paint::{PIXELS_PER_UNIT, shrink};
use super::png::encode_png;
use super::text::{HALF_CAPITAL_EM, escape};
use crate::figures::error::FigureError;
use std::fmt::Write as _;
use std::path::Path;

/// Faces, narrow ones first: the layout leaves room for the widest.
const FACES: &str = "Inter, 'Helvetica Neue', Helvetica, Arial, 'DejaVu Sans', sans-serif";
/// Letters of base 64 (RFC 4648, §4).
const BASE64: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The figure as an SVG document. Pictures are embedded; `path` is the file it is for, named in errors.
///
/// # Errors
/// [`FigureError`] when a picture cannot be encoded.
pub fn svg(canvas: &Canvas, path: &Path) -> Result<String, FigureError> {
    let (w, h) = (canvas.width, canvas.height);
    let title = escape(&canvas.description);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" font-family=\"{FACES}\">\n\
         <title>{title}</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n"
    );
    for item in &canvas.items {
        // Writing to a String does not fail.
        let _ = write_item(&mut out, item, path)?;
    }
    out.push_str("</svg>\n");
    Ok(out)
}

/// One element.
fn write_item(out: &mut String, item: &Shape, path: &Path) -> Result<std::fmt::Result, FigureError> {
    Ok(match item {
        Shape::Polygon { points, fill, opacity } => {
            let crisp = if upright(points) {
                " shape-rendering=\"crispEdges\""
            } else {
                ""
            };
            let clear = if *opacity < 1.0 {
                format!(" fill-opacity=\"{opacity}\"")
            } else {
                String::new()
            };
            let (d, fill) = (path_data(points), fill.hex());
            writeln!(
                out,
                "<path d=\"{d}Z\" fill=\"{fill}\" fill-rule=\"evenodd\"{clear}{crisp}/>"
            )
        }
        Shape::Disc { centre, radius, fill } => {
            let (x, y, r) = (number(centre.0), number(centre.1), number(*radius));
            writeln!(out, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{}\"/>", fill.hex())
        }
        Shape::Line {
            points,
            stroke,
            width,
            dash,
        } => {
            let dash = dash.map_or(String::new(), |(on, off)| format!(" stroke-dasharray=\"{on} {off}\""));
            writeln!(
                out,
                "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>",
                path_data(points),
                stroke.hex()
            )
        }
        Shape::Picture {
            at,
            size,
            width,
            height,
            rgb,
        } => {
            let (w, h, rgb) = shrink(
                rgb,
                (*width, *height),
                (size.0 * PIXELS_PER_UNIT, size.1 * PIXELS_PER_UNIT),
            );
            let data = base64(&encode_png(&rgb, w, h, path)?);
            let (x, y, w, h) = (number(at.0), number(at.1), number(size.0), number(size.1));
            writeln!(
                out,
                "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" \
                 xlink:href=\"data:image/png;base64,{data}\"/>"
            )
        }
        Shape::Text {
            at: (x, y),
            text,
            style,
        } => {
            let shift = HALF_CAPITAL_EM * style.size;
            let place = if style.upwards {
                format!(
                    "transform=\"translate({} {}) rotate(-90)\"",
                    number(x + shift),
                    number(*y)
                )
            } else {
                format!("x=\"{}\" y=\"{}\"", number(*x), number(y + shift))
            };
            let anchor = match style.anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
                Anchor::End => " text-anchor=\"end\"",
            };
            let weight = if style.bold { " font-weight=\"bold\"" } else { "" };
            let (size, fill) = (number(style.size), style.colour.hex());
            writeln!(
                out,
                "<text {place} font-size=\"{size}\"{anchor}{weight} fill=\"{fill}\">{}</text>",
                escape(text)
            )
        }
    })
}

/// Whether every edge is level or plumb.
#[expect(clippy::float_cmp, reason = "corners of a rectangle share coordinates exactly")]
fn upright(points: &[Point]) -> bool {
    points
        .windows(2)
        .all(|edge| edge[0].0 == edge[1].0 || edge[0].1 == edge[1].1)
}

/// Corners as path commands.
fn path_data(points: &[Point]) -> String {
    let mut out = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        let _ = write!(out, "{command}{} {}", number(*x), number(*y));
    }
    out
}

/// A coordinate to a hundredth of a pixel; a non-finite one is 0.
fn number(value: f64) -> String {
    let value = if value.is_finite() { value } else { 0.0 };
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Bytes in base 64 with padding (RFC 4648, §4).
fn base64(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let letter = usize::try_from(word >> (18 - 6 * place) & 63).map_or(b'=', |index| BASE64[index]);
            out.push(if place <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{base64, number};

    /// Test vectors of RFC 4648, §10.
    #[test]
    fn base64_matches_the_rfc() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn numbers_are_short_and_finite() {
        assert_eq!(number(10.0), "10");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(2.345_678), "2.35");
        assert_eq!(number(f64::NAN), "0");
    }
}
