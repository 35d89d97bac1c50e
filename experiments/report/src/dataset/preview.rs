//! Rows of a data set as a picture.

use crate::figures::canvas::{Anchor, Canvas, LINE_HEIGHT, Point, TextStyle, save_png, text_width, wrap};
use crate::figures::colour::{FRAME, INK, MUTED, Rgb};
use crate::figures::draw_heat;
use serde_json::Value;
use spts_input::Refusal;
use std::path::Path;

/// Most rows of a picture. Those of a large skin with three objects each are then 28,000 pixels high; figures are cut
/// off at 32,768.
pub const MOST_PREVIEW_ROWS: u64 = 150;

/// Border of the picture, and space between cards, across and down, CSS pixels.
const BORDER: f64 = 16.0;
const GAP: Point = (22.0, 16.0);
/// Space between the maps of a card.
const MAP_GAP: f64 = 8.0;
/// Height of the strip of samples.
const STRIP: f64 = 28.0;
/// Sizes of the title, of the words below it and of captions, and of the ends of scales.
const TITLE: f64 = 17.0;
const WORDS: f64 = 12.0;
const ENDS: f64 = 11.0;
/// Most taxels along the side of a small skin, whose taxels are large enough to be outlined.
const SMALL_SKIN: usize = 24;
/// Samples.
const BLUE: Rgb = Rgb(0x00, 0x72, 0xb2);

/// Rows of a data set, and what they are rows of.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    /// Name of the data set.
    pub name: String,
    /// Number of rows that the data set has.
    pub of: u64,
    /// The rows that are shown.
    pub rows: Vec<PreviewRow>,
}

/// Sizes of all cards.
struct Card {
    /// Cards in a line.
    columns: usize,
    /// Side of a map.
    map: f64,
    width: f64,
    /// Whether there are raster images.
    raster: bool,
    /// Whether taxels are large enough to be outlined.
    outlined: bool,
}

/// Draws a card for every row: the true pressure with the support outlined, the raster image where it is recorded, and
/// the samples. Every map and every strip has a scale of its own, and the colours of pressure go with its square root,
/// so that light touches are seen beside firm ones.
///
/// # Errors
/// [`Refusal`] when the file cannot be written.
pub fn save_preview(preview: &Preview, path: &Path) -> Result<(), Refusal> {
    save_png(&layout(preview), path)
}

/// The picture as shapes.
pub(super) fn layout(preview: &Preview) -> Canvas {
    let card = Card::of(preview);
    let width = 2.0 * BORDER + card.columns as f64 * (card.width + GAP.0) - GAP.0;
    let shown = preview.rows.len() as u64;
    let name = shortened(&preview.name, TITLE, true, 0.6 * width);
    let title = if shown == preview.of {
        format!("{name}: {} rows", grouped(shown))
    } else {
        format!("{name}: {} of {} rows", grouped(shown), grouped(preview.of))
    };
    let words = card.words();
    let title_lines = wrap(&title, TITLE, true, width - 2.0 * BORDER);
    let lines = wrap(&words, WORDS, false, width - 2.0 * BORDER);
    let words_top = BORDER + title_lines.len() as f64 * TITLE * LINE_HEIGHT + 4.0;
    let top = words_top + lines.len() as f64 * WORDS * LINE_HEIGHT + GAP.1;
    let lines_of = |rows: &[PreviewRow]| rows.iter().map(|row| card.caption(row).len()).max().unwrap_or(0);
    let captions: Vec<usize> = preview.rows.chunks(card.columns).map(lines_of).collect();
    let heights: Vec<f64> = captions.iter().map(|lines| card.height(*lines)).collect();
    let tall = heights.iter().sum::<f64>() + GAP.1 * heights.len() as f64;
    let mut canvas = Canvas::new(width, top + tall - GAP.1 + BORDER, &title);
    canvas.lines((BORDER, BORDER + 0.6 * TITLE), &title_lines, TextStyle::new(TITLE, INK).bold());
    canvas.lines((BORDER, words_top + 0.6 * WORDS), &lines, TextStyle::new(WORDS, MUTED));
    let mut y = top;
    for ((rows, lines), height) in preview.rows.chunks(card.columns).zip(captions).zip(heights) {
        let mut x = BORDER;
        for row in rows {
            card.draw(&mut canvas, row, lines, (x, y));
            x += card.width + GAP.0;
        }
        y += height + GAP.1;
    }
    canvas
}

impl Card {
    /// Cards of the rows of `preview`, about as wide together as a page.
    fn of(preview: &Preview) -> Self {
        let raster = preview.rows.iter().any(|row| row.image_v.is_some());
        let side = preview.rows.iter().map(|row| row.size.0.max(row.size.1)).max();
        let small = side.unwrap_or(0) <= SMALL_SKIN;
        let (columns, map) = match (raster, small) {
            (true, true) => (4, 100.0),
            (true, false) => (3, 136.0),
            (false, true) => (5, 160.0),
            (false, false) => (4, 204.0),
        };
        Self { columns, map, width: if raster { 2.0 * map + MAP_GAP } else { map }, raster, outlined: small }
    }

    /// What the picture shows.
    fn words(&self) -> String {
        let outlined = if self.outlined { ", outlined where the conductance has its support" } else { "" };
        let maps = if self.raster {
            format!("Left: true pressure{outlined}. Right: the image as the raster scan has it.")
        } else {
            format!("Map: true pressure{outlined}.")
        };
        format!(
            "{maps} Below: the samples of the one wire, in turn. Every map and strip has a scale of its own; the numbers are its ends. \
             Colours go with the square root of the pressure."
        )
    }

    /// The lines of its caption below the heading.
    fn caption(&self, row: &PreviewRow) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for (name, force) in &row.objects {
            let room = self.width - text_width(&format!(" {force}"), WORDS, false);
            let object = format!("{} {force}", shortened(name, WORDS, false, room));
            match lines.last_mut() {
                Some(line) if text_width(&format!("{line}, {object}"), WORDS, false) <= self.width => {
                    *line = format!("{line}, {object}");
                }
                _ => lines.push(object),
            }
        }
        lines
    }

    /// Height with a caption of so many lines.
    fn height(&self, lines: usize) -> f64 {
        (1 + lines) as f64 * WORDS * LINE_HEIGHT + 4.0 + self.map + 2.0 * (ENDS * LINE_HEIGHT + 4.0) + STRIP
    }

    /// Draws `row` with its upper left corner at `left`, `top` and room for a caption of `lines` lines.
    fn draw(&self, canvas: &mut Canvas, row: &PreviewRow, lines: usize, (left, top): Point) {
        let line = WORDS * LINE_HEIGHT;
        canvas.text((left, top + 0.5 * line), &row.heading, TextStyle::new(WORDS, INK).bold());
        canvas.lines((left, top + 1.5 * line), &self.caption(row), TextStyle::new(WORDS, INK));
        let y = top + (1 + lines) as f64 * line + 4.0;
        let ends = TextStyle::new(ENDS, MUTED).anchored(Anchor::Middle);
        let below = y + self.map + 0.5 * ENDS * LINE_HEIGHT + 2.0;
        let mut map = |shares: &[f64], text: &str, outline: Option<&[bool]>, x: f64| {
            draw_heat(canvas, shares, row.size, 1.0, outline, (x, y), self.map);
            canvas.text((x + self.map / 2.0, below), text, ends);
        };
        let peak = range(&row.pressure_kpa).map_or(0.0, |[_, high]| high.max(0.0));
        let roots: Vec<f64> = row.pressure_kpa.iter().map(|p| share(*p, [0.0, peak]).sqrt()).collect();
        let outline = (self.outlined && !row.support.is_empty()).then_some(&row.support[..]);
        map(&roots, &format!("0 to {} kPa", digits(peak)), outline, left);
        if let Some(image_v) = &row.image_v {
            let ends = range(image_v).unwrap_or_default();
            let shares: Vec<f64> = image_v.iter().map(|v| share(*v, ends)).collect();
            map(&shares, &format!("{} V", between(ends)), None, left + self.map + MAP_GAP);
        }
        let (samples, unit) = &row.samples;
        let strip = y + self.map + ENDS * LINE_HEIGHT + 4.0;
        draw_steps(canvas, samples, (left, strip), (self.width, STRIP));
        let text = match range(samples) {
            Some(ends) if unit.is_empty() => format!("{} codes: {}", samples.len(), between(ends)),
            Some(ends) => format!("{} samples: {} {unit}", samples.len(), between(ends)),
            None => format!("{} samples", samples.len()),
        };
        let below = strip + STRIP + 0.5 * ENDS * LINE_HEIGHT + 2.0;
        canvas.text((left + self.width / 2.0, below), &text, ends);
    }
}

/// As much of `text` as is no wider than `width`.
fn shortened(text: &str, size: f64, bold: bool, width: f64) -> String {
    let mut kept = text.to_owned();
    if text_width(text, size, bold) > width {
        let fits = |kept: &str| text_width(&format!("{kept}…"), size, bold) <= width;
        while !kept.is_empty() && !fits(&kept) {
            kept.pop();
        }
        kept.push('…');
    }
    kept
}

/// The least and the most of the finite `values`, if there are any.
fn range(values: &[f64]) -> Option<[f64; 2]> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    Some([finite().reduce(f64::min)?, finite().reduce(f64::max)?])
}

/// Place of a value between the two of a range, 0 to 1.
fn share(value: f64, [low, high]: [f64; 2]) -> f64 {
    if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 * value }
}

/// Draws `values` as steps between the least and the most.
fn draw_steps(canvas: &mut Canvas, values: &[f64], (x, y): Point, (w, h): Point) {
    const MARGIN: f64 = 3.0;
    canvas.frame((x, y), (w, h), FRAME, 1.0);
    let ends = range(values).unwrap_or_default();
    let pitch = w / values.len().max(1) as f64;
    let mut line = Vec::new();
    for (k, &value) in values.iter().enumerate() {
        if value.is_finite() {
            let level = y + h - MARGIN - share(value, ends) * (h - 2.0 * MARGIN);
            line.extend([(x + k as f64 * pitch, level), (x + (k + 1) as f64 * pitch, level)]);
        } else {
            canvas.line(&std::mem::take(&mut line), BLUE, 1.25);
        }
    }
    canvas.line(&line, BLUE, 1.25);
}

/// The ends of a range in words.
fn between([low, high]: [f64; 2]) -> String {
    format!("{} to {}", digits(low), digits(high))
}

/// A value in three digits or so.
fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        v if v >= 1e-3 => 3,
        v if v > 0.0 => return format!("{value:.1e}").replace('-', "−"),
        _ => 0,
    };
    format!("{value:.decimals$}").replace('-', "−")
}

/// Columns of a data set that [`PreviewRow::of`] looks at. A data set need not have all of them.
pub const PREVIEW_COLUMNS: &[&str] = &[
    "index",
    "split",
    "pressure_pa",
    "support",
    "image_v",
    "y_v",
    "y_code",
    "object",
    "force_n",
    "contact_force_n",
    "object_2",
    "force_n_2",
    "object_3",
    "force_n_3",
];

const KPA_PER_PA: f64 = 1e-3;
/// Most taxels along a side of a map that are kept, a pixel of the picture or two each; of a larger skin, means over
/// blocks of taxels are.
const MOST_SIDE: usize = 128;

/// A row as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct PreviewRow {
    /// Number of the row and its split.
    pub(super) heading: String,
    /// Name of every object, and the force on it with its unit.
    pub(super) objects: Vec<(String, String)>,
    /// Rows and columns of the maps.
    pub(super) size: (usize, usize),
    /// Pressure, kPa.
    pub(super) pressure_kpa: Vec<f64>,
    /// Support of the conductance; empty where it is not a column.
    pub(super) support: Vec<bool>,
    /// Raster image, V, where it is recorded.
    pub(super) image_v: Option<Vec<f64>>,
    /// Samples, and their unit: V, or empty for codes.
    pub(super) samples: (Vec<f64>, &'static str),
}

impl PreviewRow {
    /// The row `row`, an object of its columns as `spts_dataset` reads it, of a skin of `rows` × `cols` taxels.
    ///
    /// # Errors
    /// [`Refusal`] when a map does not fill the skin.
    pub fn of(row: &Value, (rows, cols): (usize, usize)) -> Result<Self, Refusal> {
        let index = row["index"].as_u64().unwrap_or_default();
        let map = |column: &'static str| {
            let values = numbers(&row[column]);
            let (found, needed) = (values.len(), rows * cols);
            if found == needed {
                return Ok(values);
            }
            Err(Refusal::new(format!("row {index}: `{column}` has {found} values; {needed} are needed")))
        };
        let image_v = if row["image_v"].is_array() { Some(map("image_v")?) } else { None };
        let samples =
            if row["y_code"].is_array() { (numbers(&row["y_code"]), "") } else { (numbers(&row["y_v"]), "V") };
        let step = rows.max(cols).div_ceil(MOST_SIDE);
        let small = |values: &[f64]| blocks(values, (rows, cols), step);
        let pressure_kpa: Vec<f64> = map("pressure_pa")?.iter().map(|p| p * KPA_PER_PA).collect();
        let support = if row["support"].is_array() {
            small(&map("support")?).iter().map(|share| *share >= 0.5).collect()
        } else {
            Vec::new()
        };
        Ok(Self {
            heading: format!("row {} · {}", grouped(index), row["split"].as_str().unwrap_or_default()),
            objects: objects(row),
            size: (rows.div_ceil(step), cols.div_ceil(step)),
            pressure_kpa: small(&pressure_kpa),
            support,
            image_v: image_v.map(|image| small(&image)),
            samples,
        })
    }
}

/// The name of every object of a row, and the force on it with its unit: of one object that of the moment.
fn objects(row: &Value) -> Vec<(String, String)> {
    let now_n = row["contact_force_n"].as_f64().filter(|_| row["object_2"].is_null());
    let of = |suffix: &str| {
        let name = row[&format!("object{suffix}")].as_str()?;
        let force_n = now_n.or(row[&format!("force_n{suffix}")].as_f64())?;
        Some((name.to_owned(), format!("{force_n:.1} N")))
    };
    ["", "_2", "_3"].into_iter().filter_map(of).collect()
}

/// The numbers of a list; true counts as 1, and what is no number as NaN.
fn numbers(list: &Value) -> Vec<f64> {
    let number = |value: &Value| match value {
        Value::Bool(value) => f64::from(u8::from(*value)),
        value => value.as_f64().unwrap_or(f64::NAN),
    };
    list.as_array().into_iter().flatten().map(number).collect()
}

/// Means over blocks of `step` × `step` values.
fn blocks(values: &[f64], (rows, cols): (usize, usize), step: usize) -> Vec<f64> {
    let block = |top: usize, left: usize| {
        let within =
            (top..rows.min(top + step)).flat_map(|row| (left..cols.min(left + step)).map(move |col| (row, col)));
        let (sum, count) =
            within.fold((0.0, 0.0), |(sum, count), (row, col)| (sum + values[row * cols + col], count + 1.0));
        sum / count
    };
    let tops = (0..rows).step_by(step);
    tops.flat_map(|top| (0..cols).step_by(step).map(move |left| (top, left)))
        .map(|(top, left)| block(top, left))
        .collect()
}

/// A whole number with commas between thousands.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
