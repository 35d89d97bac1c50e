//! Intervals with a mark beside each: one row a quantity, panels side by side in lines, each line with its heading.

use super::axis::Axis;
use super::chart::Style;
use super::colour::{self, CLAIM, GRID, INK, MUTED, WHITE};
use super::draw::{Anchor, Canvas, Point, TextStyle, save, text_width};
use super::error::FigureError;
use super::marker;
use std::path::Path;

/// A band with the middle of what it is made of, and the value that is held against it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Middle.
    pub middle: f64,
    /// Upper end.
    pub high: f64,
    /// Value that is held against the band; red when it lies outside.
    pub mark: f64,
}

/// One panel: an interval for every row, if there is one.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalPanel {
    /// Heading.
    pub title: String,
    /// Rows.
    pub intervals: Vec<Option<Interval>>,
}

/// Panels side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalLine {
    /// Heading.
    pub title: String,
    /// Panels, from left to right.
    pub panels: Vec<IntervalPanel>,
}

/// A figure of intervals, all between 0 and 1.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalChart {
    /// Heading of the figure.
    pub title: String,
    /// Name of the band, and of the mark.
    pub legend: [String; 2],
    /// Words beside the rows.
    pub rows: Vec<String>,
    /// Lines, from above.
    pub lines: Vec<IntervalLine>,
}

/// Writes the figure to `dir/name.svg` and `dir/name.png`.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found for the PNG.
pub fn save_intervals(chart: &IntervalChart, dir: &Path, name: &str) -> Result<(), FigureError> {
    save(&layout(chart), dir, name)
}

/// Size of row labels, ticks and panels' headings.
const SIZE: f64 = 13.0;
/// Size of the headings of figure and lines.
const HEADING: f64 = 15.0;
/// Free border.
const BORDER: f64 = 14.0;
/// Gap between panels: half a tick's label to either side.
const GAP: f64 = 40.0;
/// Height of a row.
const ROW: f64 = 22.0;
/// Width of a panel.
const PANEL: f64 = 220.0;
/// Height of the headings of a line and of its panels, and of the ticks.
const HEAD: f64 = 52.0;
const FOOT: f64 = 34.0;
/// Thickness of a band.
const BAND: f64 = 8.0;

/// The figure as shapes.
pub(super) fn layout(chart: &IntervalChart) -> Canvas {
    let labels = chart.rows.iter().map(|row| text_width(row, SIZE, false));
    let margin = labels.fold(0.0, f64::max) + 2.0 * BORDER;
    let columns = chart.lines.iter().map(|line| line.panels.len()).max().unwrap_or(0);
    let (top, inner) = (3.0 * HEADING, ROW * chart.rows.len() as f64);
    let line = HEAD + inner + FOOT;
    let bottom = top + line * chart.lines.len() as f64;
    let width = margin + columns as f64 * (PANEL + GAP);
    let mut canvas = Canvas::new(width, bottom + 2.0 * HEADING, &chart.title);
    let heading = TextStyle::new(HEADING, INK).bold();
    canvas.text((BORDER, BORDER + HEADING * 0.5), &chart.title, heading);
    let beside = TextStyle::new(SIZE, INK).anchored(Anchor::End);
    for (l, of_line) in chart.lines.iter().enumerate() {
        let y = top + line * l as f64 + HEAD;
        canvas.text((BORDER, y - 0.75 * HEAD), &of_line.title, heading);
        for (column, panel) in of_line.panels.iter().enumerate() {
            draw_panel(&mut canvas, panel, (margin + column as f64 * (PANEL + GAP), y), inner);
        }
        for (k, label) in chart.rows.iter().enumerate() {
            canvas.text((margin - BORDER, y + ROW * (k as f64 + 0.5)), label, beside);
        }
    }
    legend(&mut canvas, chart, (margin, bottom + 0.5 * HEADING));
    canvas
}

fn draw_panel(canvas: &mut Canvas, panel: &IntervalPanel, (left, top): Point, height: f64) {
    let axis = Axis::new([0.0, 1.0].into_iter(), false, Some((0.0, 1.0)));
    let column = |value: f64| axis.place(value).map(|u| left + u * PANEL);
    canvas.rect((left, top), (PANEL, height), WHITE, 1.0);
    let tick = TextStyle::new(SIZE, MUTED).anchored(Anchor::Middle);
    for (value, label) in axis.ticks(4) {
        let Some(x) = column(value) else { continue };
        canvas.line(&[(x, top), (x, top + height)], GRID, 1.0);
        canvas.line(&[(x, top + height), (x, top + height + 5.0)], CLAIM, 1.0);
        canvas.text((x, top + height + 14.0), &label, tick);
    }
    canvas.frame((left, top), (PANEL, height), CLAIM, 1.0);
    let heading = TextStyle::new(SIZE, INK).anchored(Anchor::Middle);
    canvas.text((left + 0.5 * PANEL, top - 0.25 * HEAD), &panel.title, heading);
    for (k, interval) in panel.intervals.iter().enumerate() {
        let y = top + ROW * (k as f64 + 0.5);
        if let Some(interval) = interval {
            draw_interval(canvas, *interval, y, &column);
        }
    }
}

fn draw_interval(canvas: &mut Canvas, i: Interval, y: f64, column: &dyn Fn(f64) -> Option<f64>) {
    let (Some(low), Some(middle), Some(high), Some(mark)) =
        (column(i.low), column(i.middle), column(i.high), column(i.mark))
    else {
        return;
    };
    let twin = colour::style(Style::Twin, 0);
    // a band of no width is still seen
    let width = (high - low).max(2.0);
    canvas.rect((low, y - 0.5 * BAND), (width, BAND), twin, 0.35);
    canvas.line(&[(middle, y - 0.8 * BAND), (middle, y + 0.8 * BAND)], twin, 2.0);
    if (i.low..=i.high).contains(&i.mark) {
        marker::draw(canvas, (mark, y), Style::Real, 0);
    } else {
        marker::draw(canvas, (mark, y), Style::Raster, 0);
    }
}

/// What bands and marks are, in a line.
fn legend(canvas: &mut Canvas, chart: &IntervalChart, (left, y): Point) {
    let style = TextStyle::new(SIZE, INK);
    let twin = colour::style(Style::Twin, 0);
    canvas.rect((left, y - 0.5 * BAND), (24.0, BAND), twin, 0.35);
    canvas.line(
        &[(left + 12.0, y - 0.8 * BAND), (left + 12.0, y + 0.8 * BAND)],
        twin,
        2.0,
    );
    canvas.text((left + 32.0, y), &chart.legend[0], style);
    let mut x = left + 32.0 + text_width(&chart.legend[0], SIZE, false) + 2.0 * BORDER;
    for (marked, variant, words) in [
        (Style::Real, 0, chart.legend[1].clone()),
        (Style::Raster, 0, format!("{}, outside the band", chart.legend[1])),
    ] {
        marker::draw(canvas, (x, y), marked, variant);
        canvas.text((x + 12.0, y), &words, style);
        x += 12.0 + text_width(&words, SIZE, false) + 2.0 * BORDER;
    }
    let right = x - BORDER;
    if right > canvas.width {
        canvas.width = right;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::draw::Shape;

    fn chart(mark: f64) -> IntervalChart {
        IntervalChart {
            title: "made up".to_owned(),
            legend: ["twin".to_owned(), "skin".to_owned()],
            rows: vec!["brain".to_owned(), "trig".to_owned()],
            lines: vec![IntervalLine {
                title: "IoU".to_owned(),
                panels: vec![IntervalPanel {
                    title: "M = 20".to_owned(),
                    intervals: vec![
                        Some(Interval {
                            low: 0.4,
                            middle: 0.5,
                            high: 0.6,
                            mark,
                        }),
                        None,
                    ],
                }],
            }],
        }
    }

    /// Red shapes: one in the legend, one more for a mark that lies outside.
    #[test]
    fn a_mark_outside_its_band_is_red() {
        let red = colour::style(Style::Raster, 0);
        let count = |mark: f64| {
            let canvas = layout(&chart(mark));
            let is_red = |item: &&Shape| match item {
                Shape::Polygon { fill, .. } | Shape::Disc { fill, .. } => *fill == red,
                _ => false,
            };
            canvas.items.iter().filter(is_red).count()
        };
        assert_eq!((count(0.5), count(0.7)), (1, 2));
    }
}
