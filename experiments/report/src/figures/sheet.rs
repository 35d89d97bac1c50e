//! Tactile images: sheets of them beside pictures and bars, and one large image with its colour bar.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, LINE_HEIGHT, Point, TextStyle, save, save_png, text_width, widest, wrap};
use super::colour::{FRAME, GRID, INK, MISSING, MUTED, OUTLINE, Rgb, WHITE, heat};
use spts_input::Refusal;
use std::path::Path;

/// One cell of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum Tile {
    /// A tactile image.
    Heat {
        /// Values, row-major. A negative is shown as 0, a non-finite as grey.
        values: Vec<f64>,
        /// Rows of taxels.
        rows: usize,
        /// Columns of taxels.
        cols: usize,
        /// Value at the bright end of the colours; `None` takes the image's own maximum.
        max: Option<f64>,
        /// Line below the tile.
        caption: String,
        /// True taxels, outlined: row-major, one a value.
        outline: Option<Vec<bool>>,
    },
    /// A picture, fitted into the tile with its aspect kept.
    Picture {
        /// Pixels in a row.
        width: usize,
        /// Pixels in a column.
        height: usize,
        /// Red, green, blue of every pixel, row-major.
        rgb: Vec<u8>,
        /// Line below the tile.
        caption: String,
    },
    /// A bar chart without axes, such as the voltages read so far.
    Bars {
        /// Bar heights; the largest magnitude fills the tile.
        values: Vec<f64>,
        /// The first `highlight` bars are coloured, the others grey.
        highlight: usize,
        /// Line below the tile.
        caption: String,
    },
    /// Words.
    Text(String),
    /// Nothing.
    Empty,
}

impl Tile {
    /// Line below the tile; empty where there is none.
    pub(super) fn caption(&self) -> &str {
        match self {
            Self::Heat { caption, .. } | Self::Picture { caption, .. } | Self::Bars { caption, .. } => caption,
            Self::Text(_) | Self::Empty => "",
        }
    }
}

/// A row of tiles with its label on the left.
#[derive(Debug, Clone, PartialEq)]
pub struct TileRow {
    /// Label.
    pub label: String,
    /// Tiles, left to right. Rows may be of different lengths.
    pub tiles: Vec<Tile>,
}

/// A figure of rows of tiles. More than nine rows are set as two halves, side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sheet {
    /// Heading.
    pub title: String,
    /// Headings of the columns; may be empty.
    pub column_titles: Vec<String>,
    /// Rows, top to bottom.
    pub rows: Vec<TileRow>,
    /// Side of a tile in CSS pixels; at least 24 is used.
    pub tile_px: usize,
}

/// Rows above which a sheet is set as two halves.
const ROWS_OF_ONE_HALF: usize = 9;
/// Space between tiles.
const GAP: f64 = 10.0;
/// Space between halves.
const GUTTER: f64 = 32.0;
/// Border of the figure.
const BORDER: f64 = 16.0;
/// Widest row label.
const LABEL: f64 = 150.0;
/// Size of headings of columns and of row labels.
const WORDS: f64 = 13.0;
/// Size of captions.
const CAPTION: f64 = 12.0;
/// Size of the title.
const TITLE: f64 = 17.0;

/// Sizes common to all halves.
struct SheetGrid {
    tile: f64,
    /// Width of the row labels on the left.
    label: f64,
    /// Height of the row labels above the tiles, where a sheet of two halves has them.
    above: f64,
    columns: usize,
    heads: Vec<Vec<String>>,
    head_height: f64,
}

/// Writes a sheet to `dir/name.svg` and `dir/name.png`.
///
/// # Errors
/// [`Refusal`] when a tile's values do not fill its grid, or a file cannot be written.
pub fn save_sheet(sheet: &Sheet, dir: &Path, name: &str) -> Result<(), Refusal> {
    let path = dir.join(format!("{name}.svg"));
    for tile in sheet.rows.iter().flat_map(|row| &row.tiles) {
        let (len, rows, cols, marks) = match tile {
            Tile::Heat { values, rows, cols, outline, .. } => {
                (values.len(), *rows, *cols, outline.as_ref().map(Vec::len))
            }
            Tile::Picture { width, height, rgb, .. } => (rgb.len(), *height, width * 3, None),
            _ => continue,
        };
        for len in std::iter::once(len).chain(marks) {
            if len != rows * cols {
                return Err(misshapen(&path, len, rows, cols));
            }
        }
    }
    save(&layout(sheet), dir, name)
}

/// The sheet as shapes.
pub(super) fn layout(sheet: &Sheet) -> Canvas {
    let tile = sheet.tile_px.max(24) as f64;
    let longest = sheet.rows.iter().map(|row| row.tiles.len()).max().unwrap_or(0);
    let widest = widest(sheet.rows.iter().map(|row| row.label.as_str()), WORDS, true);
    let split = sheet.rows.len() > ROWS_OF_ONE_HALF;
    let heads: Vec<_> = sheet.column_titles.iter().map(|head| wrap(head, WORDS, true, tile + GAP - 4.0)).collect();
    let head_lines = heads.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let grid = SheetGrid {
        tile,
        label: if widest > 0.0 && !split { widest.min(LABEL) + 12.0 } else { 0.0 },
        above: if widest > 0.0 && split { WORDS * LINE_HEIGHT + 4.0 } else { 0.0 },
        columns: longest.max(heads.len()).max(1),
        heads,
        head_height: if head_lines > 0.0 { head_lines * WORDS * LINE_HEIGHT + 6.0 } else { 0.0 },
    };
    let halves: Vec<&[TileRow]> = if split {
        let (left, right) = sheet.rows.split_at(sheet.rows.len().div_ceil(2));
        vec![left, right]
    } else {
        vec![&sheet.rows]
    };
    let half = grid.label + grid.columns as f64 * (tile + GAP) - GAP;
    let body = half * halves.len() as f64 + GUTTER * (halves.len() - 1) as f64;
    let width = (body + 2.0 * BORDER).max(320.0);
    let title = wrap(&sheet.title, TITLE, true, width - 2.0 * BORDER);
    let top = BORDER + if title.is_empty() { 0.0 } else { title.len() as f64 * TITLE * LINE_HEIGHT + 10.0 };
    let heights: Vec<f64> = halves.iter().map(|rows| rows.iter().map(|row| row_height(row, &grid)).sum()).collect();
    let tallest = heights.iter().copied().fold(40.0, f64::max);
    let mut canvas = Canvas::new(width, top + grid.head_height + tallest + BORDER - GAP / 2.0, &sheet.title);
    canvas.lines((BORDER, BORDER + TITLE * 0.6), &title, TextStyle::new(TITLE, INK).bold());
    for (index, rows) in halves.iter().enumerate() {
        draw_half(&mut canvas, rows, &grid, (BORDER + index as f64 * (half + GUTTER), top));
    }
    if longest == 0 {
        let at = (width / 2.0, top + grid.head_height + 20.0);
        canvas.text(at, "no data", TextStyle::new(WORDS, MUTED).anchored(Anchor::Middle));
    }
    canvas
}

/// Height of a row with its captions and the gap below.
fn row_height(row: &TileRow, grid: &SheetGrid) -> f64 {
    let lines = row.tiles.iter().map(|t| wrap(t.caption(), CAPTION, false, grid.tile + GAP).len()).max().unwrap_or(0);
    let captions = if lines > 0 { lines as f64 * CAPTION * LINE_HEIGHT + 6.0 } else { 0.0 };
    grid.above + grid.tile + captions + GAP
}

/// One half: headings of columns, then rows.
fn draw_half(canvas: &mut Canvas, rows: &[TileRow], grid: &SheetGrid, (left, top): Point) {
    let column = |index: usize| left + grid.label + index as f64 * (grid.tile + GAP);
    for (index, head) in grid.heads.iter().enumerate() {
        let lift = (head.len() as f64 - 0.5) * WORDS * LINE_HEIGHT + 6.0;
        let at = (column(index) + grid.tile / 2.0, top + grid.head_height - lift);
        canvas.lines(at, head, TextStyle::new(WORDS, INK).bold().anchored(Anchor::Middle));
    }
    let mut y = top + grid.head_height;
    for row in rows {
        draw_label(canvas, &row.label, grid, (left, y));
        let top = y + grid.above;
        for (index, tile) in row.tiles.iter().enumerate() {
            let corner = (column(index), top);
            draw_tile(canvas, tile, corner, grid.tile);
            let words = wrap(tile.caption(), CAPTION, false, grid.tile + GAP);
            let style = TextStyle::new(CAPTION, MUTED).anchored(Anchor::Middle);
            canvas.lines((corner.0 + grid.tile / 2.0, top + grid.tile + 12.0), &words, style);
        }
        y += row_height(row, grid);
    }
}

/// The label of a row, on the left of the tiles or above them.
fn draw_label(canvas: &mut Canvas, label: &str, grid: &SheetGrid, (left, top): Point) {
    let style = TextStyle::new(WORDS, INK).bold();
    if grid.above > 0.0 {
        canvas.text((left, top + grid.above / 2.0 - 2.0), label, style);
    } else {
        let lines = wrap(label, WORDS, true, LABEL);
        let first = top + grid.tile / 2.0 - (lines.len() as f64 - 1.0) * WORDS * LINE_HEIGHT / 2.0;
        canvas.lines((left + grid.label - 12.0, first), &lines, style.anchored(Anchor::End));
    }
}

fn draw_tile(canvas: &mut Canvas, tile: &Tile, corner: Point, side: f64) {
    match tile {
        Tile::Heat { values, rows, cols, max, outline, .. } => {
            let peak = max.unwrap_or_else(|| values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max));
            draw_heat(canvas, values, (*rows, *cols), peak, outline.as_deref(), corner, side);
        }
        Tile::Picture { width, height, rgb, .. } => draw_picture(canvas, (*width, *height), rgb, corner, side),
        Tile::Bars { values, highlight, .. } => {
            draw_bars(canvas, values, *highlight, corner, side);
            canvas.frame(corner, (side, side), FRAME, 1.0);
        }
        Tile::Text(text) => {
            let lines = wrap(text, WORDS, false, side - 8.0);
            let first = corner.1 + side / 2.0 - (lines.len() as f64 - 1.0) * WORDS * LINE_HEIGHT / 2.0;
            let style = TextStyle::new(WORDS, MUTED).anchored(Anchor::Middle);
            canvas.lines((corner.0 + side / 2.0, first), &lines, style);
        }
        Tile::Empty => {}
    }
}

/// A picture as large as fits.
fn draw_picture(canvas: &mut Canvas, (width, height): (usize, usize), rgb: &[u8], corner: Point, side: f64) {
    if width == 0 || height == 0 {
        canvas.frame(corner, (side, side), FRAME, 1.0);
        return;
    }
    let scale = side / width.max(height) as f64;
    let size = ((width as f64 * scale).round().max(1.0), (height as f64 * scale).round().max(1.0));
    let at = (corner.0 + ((side - size.0) / 2.0).floor(), corner.1 + ((side - size.1) / 2.0).floor());
    canvas.picture(at, size, (width, height), rgb, false);
    canvas.frame(at, size, FRAME, 1.0);
}

/// Bars from a common zero line.
fn draw_bars(canvas: &mut Canvas, values: &[f64], highlight: usize, (x, y): Point, side: f64) {
    const COLOUR: Rgb = Rgb(0x00, 0x72, 0xb2);
    canvas.rect((x, y), (side, side), WHITE, 1.0);
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
    let inner = side - 12.0;
    let scale = if high > low { inner / (high - low) } else { 0.0 };
    let nought = y + 6.0 + high * scale + if scale > 0.0 { 0.0 } else { inner };
    let pitch = inner / values.len().max(1) as f64;
    for (index, &value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let fill = if index < highlight { COLOUR } else { GRID.mix(FRAME, 0.6) };
        let tall = value.abs() * scale;
        let top = if value > 0.0 { nought - tall } else { nought };
        canvas.rect((x + 6.0 + pitch * (index as f64 + 0.1), top), (pitch * 0.8, tall), fill, 1.0);
    }
    canvas.line(&[(x + 4.0, nought), (x + side - 4.0, nought)], MUTED, 1.0);
}

/// The error of values that do not fill the grid that they are said to fill.
fn misshapen(path: &Path, len: usize, rows: usize, cols: usize) -> Refusal {
    Refusal::new(format!("{len} values do not fill {rows} × {cols} cells")).at(path.display())
}

/// Taxels up to which an image is drawn as rectangles; a larger one is a picture.
const MOST_RECTS: usize = 4096;

/// A tactile image: square taxels, centred, with the outline of the true ones. The taxels of a strip are drawn as bars,
/// so that they can be seen.
pub(crate) fn draw_heat(
    canvas: &mut Canvas,
    values: &[f64],
    (rows, cols): (usize, usize),
    peak: f64,
    outline: Option<&[bool]>,
    corner: Point,
    side: f64,
) {
    if rows == 0 || cols == 0 {
        canvas.rect(corner, (side, side), MISSING, 1.0);
        canvas.frame(corner, (side, side), FRAME, 1.0);
        return;
    }
    let cell = cell_of((rows, cols), side);
    let (w, h) = (cell.0 * cols as f64, cell.1 * rows as f64);
    let (left, top) = (corner.0 + (side - w) / 2.0, corner.1 + (side - h) / 2.0);
    let nought = heat(0.0);
    let colour = |value: &f64| {
        if value.is_finite() && peak <= 0.0 { nought } else { heat(value / peak) }
    };
    let colours: Vec<Rgb> = values.iter().take(rows * cols).map(colour).collect();
    if colours.len() > MOST_RECTS {
        let rgb: Vec<u8> = colours.iter().flat_map(|Rgb(r, g, b)| [*r, *g, *b]).collect();
        canvas.picture((left, top), (w, h), (cols, rows), &rgb, true);
    } else {
        canvas.rect((left, top), (w, h), nought, 1.0);
        // Edges of cells are rounded to half pixels, which the PNG can show sharply.
        let edge = |origin: f64, cell: f64, index: usize| ((origin + index as f64 * cell) * 2.0).round() / 2.0;
        for (taxel, &fill) in colours.iter().enumerate().filter(|(_, fill)| **fill != nought) {
            let (row, col) = (taxel / cols, taxel % cols);
            let (x, y) = (edge(left, cell.0, col), edge(top, cell.1, row));
            let size = (edge(left, cell.0, col + 1) - x, edge(top, cell.1, row + 1) - y);
            canvas.rect((x, y), size, fill, 1.0);
        }
    }
    canvas.frame((left, top), (w, h), FRAME, 1.0);
    if let Some(marks) = outline {
        draw_outline(canvas, marks, (rows, cols), (left, top), cell);
    }
}

/// Width and height of a taxel in a tile: the same, but at least a sixth of the tile for all of a strip's rows or
/// columns.
fn cell_of((rows, cols): (usize, usize), side: f64) -> (f64, f64) {
    let square = side / rows.max(cols) as f64;
    let least = side / 6.0;
    (square.max(least / cols as f64), square.max(least / rows as f64))
}

/// A thin line between true taxels and others, drawn just inside the true ones.
fn draw_outline(canvas: &mut Canvas, marks: &[bool], (rows, cols): (usize, usize), (left, top): Point, cell: Point) {
    let marked = |row: Option<usize>, col: Option<usize>| match (row, col) {
        (Some(row), Some(col)) if row < rows && col < cols => marks.get(row * cols + col).copied().unwrap_or(false),
        _ => false,
    };
    for row in 0..rows {
        for col in (0..cols).filter(|&col| marked(Some(row), Some(col))) {
            let (x0, y0) = (left + col as f64 * cell.0, top + row as f64 * cell.1);
            let (x1, y1) = (x0 + cell.0, y0 + cell.1);
            let sides = [
                (marked(row.checked_sub(1), Some(col)), [(x0, y0), (x1, y0)]),
                (marked(Some(row + 1), Some(col)), [(x0, y1), (x1, y1)]),
                (marked(Some(row), col.checked_sub(1)), [(x0, y0), (x0, y1)]),
                (marked(Some(row), Some(col + 1)), [(x1, y0), (x1, y1)]),
            ];
            for (_, line) in sides.iter().filter(|(inside, _)| !inside) {
                canvas.line(line, OUTLINE, 1.5);
            }
        }
    }
}

/// Longest side of the map in CSS pixels.
const MAP: f64 = 560.0;
/// The same of a strip: a map that is more than [`STRIP`] times as long as wide.
const LONG_MAP: f64 = 960.0;
const STRIP: usize = 4;
/// Least height of the colour bar in CSS pixels.
const LEAST_BAR: f64 = 160.0;
/// Steps of the colour bar.
const BAR_STEPS: u32 = 140;

/// Paints one tactile image with a colour bar and the indices of the taxels.
///
/// `values` are row-major; `value · scale` is shown, in `unit_label`. A negative value is shown as 0, a non-finite
/// one as grey.
///
/// # Errors
/// [`Refusal`] when the values do not fill the grid, or the file cannot be written.
pub fn pressure_png(
    values: &[f64],
    rows: usize,
    cols: usize,
    unit_label: &str,
    scale: f64,
    title: &str,
    path: &Path,
) -> Result<(), Refusal> {
    if values.len() != rows * cols || values.is_empty() {
        return Err(misshapen(path, values.len(), rows, cols));
    }
    let shown: Vec<f64> = values.iter().map(|value| value * scale).collect();
    save_png(&pressure_layout(&shown, (rows, cols), unit_label, title), path)
}

/// The picture as shapes.
fn pressure_layout(shown: &[f64], (rows, cols): (usize, usize), unit: &str, title: &str) -> Canvas {
    let longest = rows.max(cols);
    let side = if longest > STRIP * rows.min(cols) { LONG_MAP } else { MAP };
    let cell = (side / longest as f64).floor().max(1.0);
    let (w, h) = (cell * cols as f64, cell * rows as f64);
    let (left, width) = (56.0, 56.0 + w + 130.0);
    let heading = wrap(title, 18.0, true, width - 2.0 * 20.0);
    let top = 62.0 + 24.0 * heading.len() as f64;
    let bar_h = h.max(LEAST_BAR);
    let mut canvas = Canvas::new(width, top + bar_h + 24.0, title);
    canvas.lines((20.0, 28.0), &heading, TextStyle::new(18.0, INK).bold());

    let peak = shown.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let axis = Axis::new([0.0, peak].into_iter(), false, (peak > 0.0).then_some((0.0, peak)));
    let share = |value: f64| if peak > 0.0 { value / peak } else { value * 0.0 };
    let fills: Vec<Rgb> = shown.iter().map(|value| heat(share(*value))).collect();
    if fills.len() > MOST_RECTS {
        let rgb: Vec<u8> = fills.iter().flat_map(|Rgb(r, g, b)| [*r, *g, *b]).collect();
        canvas.picture((left, top), (w, h), (cols, rows), &rgb, true);
    }
    for (taxel, (&value, &fill)) in shown.iter().zip(&fills).enumerate().filter(|_| fills.len() <= MOST_RECTS) {
        let corner = (left + (taxel % cols) as f64 * cell, top + (taxel / cols) as f64 * cell);
        canvas.rect(corner, (cell, cell), fill, 1.0);
        if cell >= 40.0 && value.is_finite() {
            let middle = (corner.0 + cell / 2.0, corner.1 + cell / 2.0);
            let style = TextStyle::new(12.0, contrast(fill)).anchored(Anchor::Middle);
            canvas.text(middle, &reading(value.max(0.0), peak), style);
        }
    }
    canvas.frame((left, top), (w, h), FRAME, 1.0);
    // labels do not touch
    let every = ((text_width(&longest.to_string(), 12.0, false) + 8.0) / cell).ceil().max(1.0);
    let index = TextStyle::new(12.0, MUTED).anchored(Anchor::Middle);
    for col in (0..cols).filter(|&col| (col as f64 % every) < 0.5) {
        canvas.text((left + (col as f64 + 0.5) * cell, top - 12.0), &col.to_string(), index);
    }
    for row in (0..rows).filter(|&row| (row as f64 % every) < 0.5) {
        let at = (left - 8.0, top + (row as f64 + 0.5) * cell);
        canvas.text(at, &row.to_string(), index.anchored(Anchor::End));
    }
    canvas.text((18.0, top + h / 2.0), "row", index.upwards());
    canvas.text((left + w / 2.0, top - 30.0), "column", index);

    let bar = left + w + 28.0;
    for step in 0..BAR_STEPS {
        let (from, to) = (f64::from(step) / f64::from(BAR_STEPS), f64::from(step + 1) / f64::from(BAR_STEPS));
        let (y0, y1) = ((top + bar_h * (1.0 - to)).round(), (top + bar_h * (1.0 - from)).round());
        canvas.rect((bar, y0), (20.0, y1 - y0), heat((from + to) / 2.0), 1.0);
    }
    canvas.frame((bar, top), (20.0, bar_h), FRAME, 1.0);
    for (tick, label) in if peak > 0.0 { axis.ticks(6) } else { vec![(0.0, "0".to_owned())] } {
        let place = if peak > 0.0 { axis.place(tick).unwrap_or(0.0) } else { 0.0 };
        let y = top + bar_h * (1.0 - place);
        canvas.line(&[(bar + 20.0, y), (bar + 25.0, y)], MUTED, 1.0);
        canvas.text((bar + 30.0, y), &label, TextStyle::new(13.0, INK));
    }
    canvas.text((bar, top - 16.0), unit, TextStyle::new(13.0, INK));
    canvas
}

/// A value in three digits or so, on the scale of the largest.
fn reading(value: f64, peak: f64) -> String {
    let decimals = match peak {
        p if p >= 100.0 => 0,
        p if p >= 10.0 => 1,
        p if p >= 0.1 => 2,
        _ => {
            return if value > 0.0 { format!("{value:.0e}") } else { "0".to_owned() };
        }
    };
    format!("{value:.decimals$}")
}

/// Black or white, whichever reads better on `fill`: the luma of Rec. 709 decides.
fn contrast(fill: Rgb) -> Rgb {
    let luma = 0.2126 * f64::from(fill.0) + 0.7152 * f64::from(fill.1) + 0.0722 * f64::from(fill.2);
    if luma > 128.0 { INK } else { WHITE }
}
