//! A figure while it is drawn: shapes and text, as SVG 1.1; and as a file, of that text or of the pixels that are
//! painted from it.
//!
//! The text of pixels is set in a font that is part of the program (Inter, in `assets`): a figure has the same bytes on
//! every machine.

use super::colour::Rgb;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use png::{ColorType, DeflateCompression, Encoder, Filter};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};
use spts::output::{unwritable, write_bytes};
use spts_eval::escape;
use spts_input::Refusal;
use std::fmt::Write as _;
use std::io::{self, Read as _};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// A position in CSS pixels; y points down.
pub type Point = (f64, f64);

/// Faces: the one that the PNG files are painted with, then the usual ones; the layout leaves room for the widest.
const FACES: &str = "Inter, 'Helvetica Neue', Helvetica, Arial, 'DejaVu Sans', sans-serif";
/// Height of a capital above the base line, halved, in em: moves the anchor from the middle to the base line.
const HALF_CAPITAL_EM: f64 = 0.36;
/// Distance between lines of text, in em.
pub(crate) const LINE_HEIGHT: f64 = 1.3;

/// Which end of a text its position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Left end.
    Start,
    /// Middle.
    Middle,
    /// Right end.
    End,
}

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextStyle {
    /// Size of an em in CSS pixels.
    pub size: f64,
    /// Bold face.
    pub bold: bool,
    /// Colour.
    pub colour: Rgb,
    /// Which end of the text its position is.
    pub anchor: Anchor,
    /// Turned a quarter to read upwards.
    pub upwards: bool,
}

impl TextStyle {
    /// Regular, level text that starts at its position.
    pub const fn new(size: f64, colour: Rgb) -> Self {
        Self { size, bold: false, colour, anchor: Anchor::Start, upwards: false }
    }

    /// The same in bold.
    pub(crate) const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// The same at another anchor.
    pub(crate) const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same reading upwards.
    pub const fn upwards(self) -> Self {
        Self { upwards: true, ..self }
    }
}

/// A figure on white. What is added later lies above what was added before.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    /// Width in CSS pixels.
    pub width: f64,
    /// Height in CSS pixels.
    pub height: f64,
    /// What the figure shows, for those who cannot see it.
    pub description: String,
    /// Elements, one a line.
    elements: String,
}

impl Canvas {
    /// A blank figure.
    pub fn new(width: f64, height: f64, description: &str) -> Self {
        Self {
            width: width.ceil(),
            height: height.ceil(),
            description: description.to_owned(),
            elements: String::new(),
        }
    }

    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        let (w, h) = (number(self.width), number(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
             width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" font-family=\"{FACES}\">\n\
             <title>{}</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            escape(&self.description),
            self.elements
        )
    }

    fn add(&mut self, element: &str) {
        self.elements.push_str(element);
        self.elements.push('\n');
    }

    /// Adds a filled rectangle.
    pub(crate) fn rect(&mut self, (x, y): Point, (w, h): Point, fill: Rgb, opacity: f64) {
        let (left, top) = (number(x.min(x + w)), number(y.min(y + h)));
        let (w, h, fill, clear) = (number(w.abs()), number(h.abs()), fill.hex(), clear(opacity));
        self.add(&format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" fill=\"{fill}\"{clear} \
             shape-rendering=\"crispEdges\"/>"
        ));
    }

    /// Adds a filled polygon.
    pub fn polygon(&mut self, points: &[Point], fill: Rgb, opacity: f64) {
        let (d, fill, clear) = (path_data(points), fill.hex(), clear(opacity));
        self.add(&format!("<path d=\"{d}Z\" fill=\"{fill}\" fill-rule=\"evenodd\"{clear}/>"));
    }

    /// Adds a filled disc.
    pub fn disc(&mut self, (x, y): Point, radius: f64, fill: Rgb) {
        let (x, y, r, fill) = (number(x), number(y), number(radius), fill.hex());
        self.add(&format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{fill}\"/>"));
    }

    /// Adds a solid line.
    pub fn line(&mut self, points: &[Point], stroke: Rgb, width: f64) {
        self.dashed(points, stroke, width, None);
    }

    /// Adds a line with round joins; `dash` has the lengths of dash and gap.
    pub(crate) fn dashed(&mut self, points: &[Point], stroke: Rgb, width: f64, dash: Option<(f64, f64)>) {
        let dash = dash.map_or(String::new(), |(on, off)| format!(" stroke-dasharray=\"{on} {off}\""));
        let (d, stroke) = (path_data(points), stroke.hex());
        self.add(&format!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>"
        ));
    }

    /// Adds the outline of a rectangle.
    pub fn frame(&mut self, (x, y): Point, (w, h): Point, stroke: Rgb, width: f64) {
        self.line(&[(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)], stroke, width);
    }

    /// Adds a picture of `shape` = (columns, rows) pixels, red, green and blue row by row, stretched over a rectangle.
    /// `sharp` pixels stay squares when they are enlarged.
    pub fn picture(&mut self, (x, y): Point, size: Point, shape: (usize, usize), rgb: &[u8], sharp: bool) {
        // no more pixels than the PNG file shows
        let most = |side: f64, pixels: usize| index((side * PIXELS_PER_UNIT).round(), pixels).max(1);
        let (w, h) = (most(size.0, shape.0), most(size.1, shape.1));
        // a picture in memory is always encoded
        let png = encode_png(&resample(rgb, shape, (w, h)), w, h).unwrap_or_default();
        let (x, y, w, h) = (number(x), number(y), number(size.0), number(size.1));
        let sharp = if sharp { " image-rendering=\"pixelated\"" } else { "" };
        self.add(&format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\"{sharp} \
             xlink:href=\"data:image/png;base64,{}\"/>",
            STANDARD.encode(&png)
        ));
    }

    /// Adds a line of text; an empty one adds nothing. `at` is the end that the anchor names, at half the height of a
    /// capital.
    pub fn text(&mut self, (x, y): Point, text: &str, style: TextStyle) {
        if text.trim().is_empty() {
            return;
        }
        let shift = HALF_CAPITAL_EM * style.size;
        let place = if style.upwards {
            format!("transform=\"translate({} {}) rotate(-90)\"", number(x + shift), number(y))
        } else {
            format!("x=\"{}\" y=\"{}\"", number(x), number(y + shift))
        };
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let weight = if style.bold { " font-weight=\"bold\"" } else { "" };
        let (size, fill, text) = (number(style.size), style.colour.hex(), escape(text));
        self.add(&format!("<text {place} font-size=\"{size}\"{anchor}{weight} fill=\"{fill}\">{text}</text>"));
    }

    /// Adds lines of text, one below the other, the first at `at`.
    pub fn lines(&mut self, (x, y): Point, lines: &[String], style: TextStyle) {
        let mut middle = y;
        for line in lines {
            self.text((x, middle), line, style);
            middle += style.size * LINE_HEIGHT;
        }
    }
}

fn clear(opacity: f64) -> String {
    if opacity < 1.0 { format!(" fill-opacity=\"{opacity}\"") } else { String::new() }
}

/// Corners as path commands.
fn path_data(points: &[Point]) -> String {
    let mut out = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        // writing to a String does not fail
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

/// Advance of a character of DejaVu Sans in em, within about 10 %. Wider than the usual sans-serif faces, so a text
/// that fits by this measure fits in any of them.
fn advance_em(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '\'' | '|' => 0.29,
        ' ' | '.' | ',' | ':' | ';' | '!' | 'I' | 'f' | 't' | '(' | ')' | '[' | ']' | '/' | '·' => 0.37,
        'r' | '"' | '-' => 0.42,
        's' | 'z' | 'c' | 'v' | 'x' | 'y' | 'k' => 0.57,
        'm' | 'W' | '%' | '@' => 0.98,
        'M' | 'w' | '–' | '±' | '×' | '=' | '<' | '>' | '≥' | '≤' | '+' => 0.85,
        c if c.is_ascii_uppercase() => 0.71,
        c if c.is_ascii() => 0.64,
        _ => 0.72,
    }
}

/// Width of a text in the unit of `size`, the em.
pub(crate) fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    text.chars().map(advance_em).sum::<f64>() * size * if bold { 1.12 } else { 1.0 }
}

/// Width of the widest of several texts.
pub fn widest<'a>(texts: impl IntoIterator<Item = &'a str>, size: f64, bold: bool) -> f64 {
    texts.into_iter().map(|text| text_width(text, size, bold)).fold(0.0, f64::max)
}

/// Breaks a text between words into lines no wider than `width`; a longer word keeps a line of its own. A number
/// stays with its unit, and a relation with both of its sides.
pub fn wrap(text: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for phrase in phrases(text) {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {phrase}"), size, bold) <= width => {
                line.push(' ');
                line.push_str(&phrase);
            }
            _ => lines.push(phrase),
        }
    }
    lines
}

/// Words, and groups of words that belong on one line.
fn phrases(text: &str) -> Vec<String> {
    /// Longest word after a number that is taken for its unit, in characters.
    const UNIT_LENGTH: usize = 3;
    let relation = |word: &str| matches!(word, "=" | "<" | ">" | "≤" | "≥" | "≈" | "±" | "×" | "·");
    let mut out: Vec<String> = Vec::new();
    let mut last = "";
    for word in text.split_whitespace() {
        let unit = last.ends_with(|c: char| c.is_ascii_digit()) && word.chars().count() <= UNIT_LENGTH;
        let equals = matches!(word, "=" | "±" | "×" | "·");
        match out.last_mut() {
            Some(phrase) if unit || equals || relation(last) => {
                phrase.push(' ');
                phrase.push_str(word);
            }
            _ => out.push(word.to_owned()),
        }
        last = word;
    }
    out
}

/// PNG pixels to the CSS pixel.
pub(crate) const PIXELS_PER_UNIT: f64 = 2.0;
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
    Options { font_family: "Inter".to_owned(), fontdb: Arc::new(fonts), ..Options::default() }
});

/// Writes a figure to `dir/name.svg` and `dir/name.png`. The folder is made if it is missing.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn save(canvas: &Canvas, dir: &Path, name: &str) -> Result<(), Refusal> {
    std::fs::create_dir_all(dir).map_err(unwritable(dir))?;
    write_bytes(&dir.join(format!("{name}.svg")), canvas.svg().as_bytes())?;
    save_png(canvas, &dir.join(format!("{name}.png")))
}

/// Writes a figure as PNG.
///
/// # Errors
/// [`Refusal`] when the file cannot be written.
pub(crate) fn save_png(canvas: &Canvas, path: &Path) -> Result<(), Refusal> {
    write_bytes(path, &png_of(canvas).map_err(unwritable(path))?)
}

/// A figure as the bytes of a PNG file.
///
/// # Errors
/// When the figure cannot be painted.
pub(crate) fn png_of(canvas: &Canvas) -> io::Result<Vec<u8>> {
    let (width, height, rgb) = paint(canvas)?;
    encode_png(&rgb, width, height)
}

/// Paints the figure. Returns width, height and RGB pixels.
///
/// # Errors
/// When the figure is too large for the memory.
pub(crate) fn paint(canvas: &Canvas) -> io::Result<(usize, usize, Vec<u8>)> {
    let side = |value: f64| index(value * PIXELS_PER_UNIT, MOST_PIXELS).max(1);
    let (width, height) = (side(canvas.width), side(canvas.height));
    let tree = Tree::from_str(&canvas.svg(), &PAINTING).map_err(io::Error::other)?;
    let pixels = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let mut pixmap = Pixmap::new(pixels(width), pixels(height)).ok_or(io::ErrorKind::OutOfMemory)?;
    #[expect(clippy::cast_possible_truncation, reason = "2 is exact")]
    let scale = PIXELS_PER_UNIT as f32;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    // every pixel is opaque: the figure stands on white
    let rgb = pixmap.data().chunks_exact(4).flat_map(|rgba| [rgba[0], rgba[1], rgba[2]]);
    Ok((width, height, rgb.collect()))
}

/// An RGB picture as the bytes of a PNG file.
///
/// # Errors
/// When the picture does not fill its size.
pub fn encode_png(rgb: &[u8], width: usize, height: usize) -> io::Result<Vec<u8>> {
    if rgb.len() != width * height * 3 || rgb.is_empty() {
        let len = rgb.len();
        return Err(io::Error::other(format!("{len} values do not fill {height} × {} cells", width * 3)));
    }
    let side = |value: usize| u32::try_from(value).map_err(io::Error::other);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, side(width)?, side(height)?);
    encoder.set_color(ColorType::Rgb);
    encoder.set_deflate_compression(DeflateCompression::Level(EFFORT));
    encoder.set_filter(FILTER);
    let [key, program] = MARK;
    encoder.add_text_chunk(key.to_owned(), program.to_owned())?;
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(bytes)
}

/// What our pictures say of themselves: keyword and text of a PNG.
const MARK: [&str; 2] = ["Software", "spts"];
/// Bytes at the beginning of a PNG in which the mark stands.
const MARKED: u64 = 256;

/// Whether the file at `path` is a picture that this program wrote, and that no other program has saved since.
pub fn is_own_picture(path: &Path) -> bool {
    let mut start = Vec::new();
    let read =
        spts_input::open(path, u64::MAX).is_ok_and(|(file, _)| file.take(MARKED).read_to_end(&mut start).is_ok());
    let mark = ["tEXt", MARK[0], "\0", MARK[1]].concat();
    read && start.windows(mark.len()).any(|window| window == mark.as_bytes())
}

/// A pixel index of a coordinate, clamped to `0..=limit`.
#[expect(clippy::cast_possible_truncation, reason = "clamped to a picture's size")]
fn index(value: f64, limit: usize) -> usize {
    if value > 0.0 { (value as usize).min(limit) } else { 0 }
}

/// A picture at another size: the mean over the source pixels under each new one.
pub(crate) fn resample(rgb: &[u8], (width, height): (usize, usize), (w, h): (usize, usize)) -> Vec<u8> {
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
                    sum.iter_mut().zip(&rgb[start..start + 3]).for_each(|(sum, &part)| *sum += usize::from(part));
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
    fn numbers_are_short_and_finite() {
        let shown = [10.0, -0.001, 2.345_678, f64::NAN].map(number);
        assert_eq!(shown, ["10", "0", "2.35", "0"]);
    }

    #[test]
    fn lines_break_between_phrases() {
        let lines = wrap("paper: ≥ 98 % at M = 20", 10.0, false, 1.0);
        assert_eq!(lines, ["paper:", "≥ 98 %", "at", "M = 20"]);
        assert_eq!(wrap("one line", 10.0, false, 1e3), ["one line"]);
        assert!(wrap("  ", 10.0, false, 1.0).is_empty());
    }

    #[test]
    fn shrinking_averages_and_growing_repeats() {
        let two = [10, 20, 30, 30, 40, 50];
        assert_eq!(resample(&two, (2, 1), (1, 1)), [20, 30, 40]);
        assert_eq!(resample(&two, (2, 1), (4, 1)), [10, 20, 30, 10, 20, 30, 30, 40, 50, 30, 40, 50]);
        assert_eq!(resample(&[], (0, 0), (1, 1)), [255; 3]);
    }

    /// The pixels of text are ours alone: these are the same on every machine.
    #[test]
    fn pixels_do_not_depend_on_the_machine() {
        let mut canvas = Canvas::new(200.0, 40.0, "");
        let style = TextStyle::new(14.0, super::super::colour::INK);
        canvas.text((4.0, 10.0), "Φ·x = 0.5 µs ± 10⁻⁴, M ≥ 20", style);
        canvas.text((4.0, 30.0), "bold", style.bold());
        let (width, height, rgb) = paint(&canvas).unwrap();
        assert_eq!((width, height), (400, 80));
        // FNV-1a
        let hash =
            rgb.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3));
        assert_eq!(hash, 0x949b_63ad_3925_b1b5, "{hash:#x}");
    }
}
