//! Layout of sheets.

use super::colour::{FRAME, GRID, INK, MUTED, Rgb, WHITE};
use super::draw::{Anchor, Canvas, LINE_HEIGHT, Point, Shape, TextStyle, save, text_width, wrap};
use super::error::FigureError;
use super::heat_map::draw_heat;
use super::tiles::{Sheet, Tile, TileRow};
use std::path::Path;

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
/// [`FigureError`] when a tile's values do not fill its grid, a file cannot be written or no font is found for the
/// PNG.
pub fn save_sheet(sheet: &Sheet, dir: &Path, name: &str) -> Result<(), FigureError> {
    let path = dir.join(format!("{name}.svg"));
    for tile in sheet.rows.iter().flat_map(|row| &row.tiles) {
        let (len, rows, cols, marks) = match tile {
            Tile::Heat {
                values,
                rows,
                cols,
                outline,
                ..
            } => (values.len(), *rows, *cols, outline.as_ref().map(Vec::len)),
            Tile::Picture { width, height, rgb, .. } => (rgb.len(), *height, width * 3, None),
            _ => continue,
        };
        for len in std::iter::once(len).chain(marks) {
            if len != rows * cols {
                return Err(FigureError::Shape { path, len, rows, cols });
            }
        }
    }
    save(&layout(sheet), dir, name)
}

/// The sheet as shapes.
pub(super) fn layout(sheet: &Sheet) -> Canvas {
    let tile = sheet.tile_px.max(24) as f64;
    let longest = sheet.rows.iter().map(|row| row.tiles.len()).max().unwrap_or(0);
    let widest = sheet
        .rows
        .iter()
        .map(|row| text_width(&row.label, WORDS, true))
        .fold(0.0, f64::max);
    let split = sheet.rows.len() > ROWS_OF_ONE_HALF;
    let heads: Vec<_> = sheet
        .column_titles
        .iter()
        .map(|head| wrap(head, WORDS, true, tile + GAP - 4.0))
        .collect();
    let head_lines = heads.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let grid = SheetGrid {
        tile,
        label: if widest > 0.0 && !split {
            widest.min(LABEL) + 12.0
        } else {
            0.0
        },
        above: if widest > 0.0 && split {
            WORDS * LINE_HEIGHT + 4.0
        } else {
            0.0
        },
        columns: longest.max(heads.len()).max(1),
        heads,
        head_height: if head_lines > 0.0 {
            head_lines * WORDS * LINE_HEIGHT + 6.0
        } else {
            0.0
        },
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
    let top = BORDER
        + if title.is_empty() {
            0.0
        } else {
            title.len() as f64 * TITLE * LINE_HEIGHT + 10.0
        };
    let heights: Vec<f64> = halves
        .iter()
        .map(|rows| rows.iter().map(|row| row_height(row, &grid)).sum())
        .collect();
    let tallest = heights.iter().copied().fold(40.0, f64::max);
    let mut canvas = Canvas::new(
        width,
        top + grid.head_height + tallest + BORDER - GAP / 2.0,
        &sheet.title,
    );
    canvas.lines(
        (BORDER, BORDER + TITLE * 0.6),
        &title,
        TextStyle::new(TITLE, INK).bold(),
    );
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
    let lines = row
        .tiles
        .iter()
        .map(|t| wrap(t.caption(), CAPTION, false, grid.tile + GAP).len())
        .max()
        .unwrap_or(0);
    let captions = if lines > 0 {
        lines as f64 * CAPTION * LINE_HEIGHT + 6.0
    } else {
        0.0
    };
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
        Tile::Heat {
            values,
            rows,
            cols,
            max,
            outline,
            ..
        } => {
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
    let size = (
        (width as f64 * scale).round().max(1.0),
        (height as f64 * scale).round().max(1.0),
    );
    let at = (
        corner.0 + ((side - size.0) / 2.0).floor(),
        corner.1 + ((side - size.1) / 2.0).floor(),
    );
    canvas.items.push(Shape::Picture {
        at,
        size,
        width,
        height,
        rgb: rgb.to_vec(),
    });
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
        let fill = if index < highlight {
            COLOUR
        } else {
            GRID.mix(FRAME, 0.6)
        };
        let tall = value.abs() * scale;
        let top = if value > 0.0 { nought - tall } else { nought };
        canvas.rect(
            (x + 6.0 + pitch * (index as f64 + 0.1), top),
            (pitch * 0.8, tall),
            fill,
            1.0,
        );
    }
    canvas.line(&[(x + 4.0, nought), (x + side - 4.0, nought)], MUTED, 1.0);
}
