//! A tactile image as coloured taxels.

use super::colour::{FRAME, MISSING, OUTLINE, heat};
use super::draw::{Canvas, Point};

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
    canvas.rect((left, top), (w, h), nought, 1.0);
    // Edges of cells are rounded to half pixels, which the PNG can show sharply.
    let edge = |origin: f64, cell: f64, index: usize| ((origin + index as f64 * cell) * 2.0).round() / 2.0;
    for (taxel, &value) in values.iter().enumerate().take(rows * cols) {
        let (row, col) = (taxel / cols, taxel % cols);
        let fill = if value.is_finite() && peak <= 0.0 {
            nought
        } else {
            heat(value / peak)
        };
        if fill != nought {
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
