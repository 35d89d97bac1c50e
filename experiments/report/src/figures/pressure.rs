//! One large tactile image with its colour bar.

use super::axis::Axis;
use super::colour::{FRAME, INK, MUTED, Rgb, WHITE, heat};
use super::draw::{Anchor, Canvas, TextStyle, save_png, wrap};
use super::error::FigureError;
use std::path::Path;

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
/// [`FigureError`] when the values do not fill the grid, the file cannot be written or no font is found.
pub fn pressure_png(
    values: &[f64],
    rows: usize,
    cols: usize,
    unit_label: &str,
    scale: f64,
    title: &str,
    path: &Path,
) -> Result<(), FigureError> {
    if values.len() != rows * cols || values.is_empty() {
        return Err(FigureError::Shape {
            path: path.to_owned(),
            len: values.len(),
            rows,
            cols,
        });
    }
    let shown: Vec<f64> = values.iter().map(|value| value * scale).collect();
    save_png(&layout(&shown, (rows, cols), unit_label, title), path)
}

/// The picture as shapes.
fn layout(shown: &[f64], (rows, cols): (usize, usize), unit: &str, title: &str) -> Canvas {
    let longest = rows.max(cols);
    let side = if longest > STRIP * rows.min(cols) {
        LONG_MAP
    } else {
        MAP
    };
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
    for (taxel, &value) in shown.iter().enumerate() {
        let (row, col) = ((taxel / cols) as f64, (taxel % cols) as f64);
        let corner = (left + col * cell, top + row * cell);
        let fill = heat(share(value));
        canvas.rect(corner, (cell, cell), fill, 1.0);
        if cell >= 40.0 && value.is_finite() {
            let middle = (corner.0 + cell / 2.0, corner.1 + cell / 2.0);
            let style = TextStyle::new(12.0, contrast(fill)).anchored(Anchor::Middle);
            canvas.text(middle, &reading(value.max(0.0), peak), style);
        }
    }
    canvas.frame((left, top), (w, h), FRAME, 1.0);
    let every = (16.0 / cell).ceil().max(1.0);
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
        let (from, to) = (
            f64::from(step) / f64::from(BAR_STEPS),
            f64::from(step + 1) / f64::from(BAR_STEPS),
        );
        let (y0, y1) = ((top + bar_h * (1.0 - to)).round(), (top + bar_h * (1.0 - from)).round());
        canvas.rect((bar, y0), (20.0, y1 - y0), heat((from + to) / 2.0), 1.0);
    }
    canvas.frame((bar, top), (20.0, bar_h), FRAME, 1.0);
    for (tick, label) in if peak > 0.0 {
        axis.ticks(6)
    } else {
        vec![(0.0, "0".to_owned())]
    } {
        let place = if peak > 0.0 {
            axis.place(tick).unwrap_or(0.0)
        } else {
            0.0
        };
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
            return if value > 0.0 {
                format!("{value:.0e}")
            } else {
                "0".to_owned()
            };
        }
    };
    format!("{value:.decimals$}")
}

/// Black or white, whichever reads better on `fill`: the luma of Rec. 709 decides.
fn contrast(fill: Rgb) -> Rgb {
    let luma = 0.2126 * f64::from(fill.0) + 0.7152 * f64::from(fill.1) + 0.0722 * f64::from(fill.2);
    if luma > 128.0 { INK } else { WHITE }
}
