//! Horizontal bars with error bars: one row a quantity, one or several bars in it, one or several panels side by side.

use super::axis::Axis;
use super::chart::Style;
use super::colour::{self, CLAIM, GRID, INK, MUTED, WHITE};
use super::draw::{Anchor, Canvas, Point, Shape, TextStyle, save, text_width};
use super::error::FigureError;
use std::path::Path;

/// The value that a bar shows, and its standard error, which is drawn as an error bar.
pub type Bar = (f64, f64);

/// A kind of bar with its name and colour. Every row of the chart has one bar of each kind, such as one for each
/// decoder.
#[derive(Debug, Clone, PartialEq)]
pub struct BarGroup {
    /// Name in the legend.
    pub name: String,
    /// Colour.
    pub style: Style,
}

/// One row of the chart: a quantity, with its bars in every panel.
#[derive(Debug, Clone, PartialEq)]
pub struct BarRow {
    /// Words beside the bars.
    pub label: String,
    /// Whether the row sums up the ones below it, and is set off from them.
    pub heading: bool,
    /// The bars: `values[panel][group]`; `None` where there is no bar.
    pub values: Vec<Vec<Option<Bar>>>,
}

/// A figure of bars. All panels have the same rows and the same axis.
#[derive(Debug, Clone, PartialEq)]
pub struct BarChart {
    /// Heading of the figure.
    pub title: String,
    /// Quantity and unit of the bars.
    pub x_label: String,
    /// Headings of the panels.
    pub panels: Vec<String>,
    /// Kinds of bars.
    pub groups: Vec<BarGroup>,
    /// Rows from top to bottom.
    pub rows: Vec<BarRow>,
}

/// Writes the figure to `dir/name.svg` and `dir/name.png`.
///
/// # Errors
/// [`FigureError`] when a file cannot be written or no font is found for the PNG.
pub fn save_bars(chart: &BarChart, dir: &Path, name: &str) -> Result<(), FigureError> {
    save(&layout(chart), dir, name)
}

/// Size of row labels and ticks.
const SIZE: f64 = 13.0;
/// Size of headings.
const HEADING: f64 = 15.0;
/// Free border, and half the gap between panels.
const BORDER: f64 = 12.0;
/// Height of a bar.
const BAR: f64 = 8.0;
/// Free height between rows.
const GAP: f64 = 9.0;
/// Half the height of an error bar's ends.
const CAP: f64 = 2.5;
/// Height of axis, ticks and legend below the rows.
const FOOT: f64 = 84.0;

/// The figure as shapes.
pub(super) fn layout(chart: &BarChart) -> Canvas {
    let labels = chart.rows.iter().map(|row| text_width(&row.label, SIZE, row.heading));
    let margin = labels.fold(0.0, f64::max) + 2.0 * BORDER;
    let panel = match chart.panels.len() {
        0 | 1 => 460.0,
        2 => 340.0,
        _ => 260.0,
    };
    let row = BAR * chart.groups.len() as f64 + GAP;
    let (top, height) = (2.0 * BORDER + 2.6 * HEADING, row * chart.rows.len() as f64);
    let width = margin + panel * chart.panels.len().max(1) as f64 + BORDER;
    let mut canvas = Canvas::new(width, top + height + FOOT, &chart.title);
    let heading = TextStyle::new(HEADING, INK).bold();
    canvas.text((BORDER, BORDER + HEADING * 0.65), &chart.title, heading);
    let ends = chart.rows.iter().flat_map(|row| row.values.iter().flatten().flatten());
    let axis = Axis::new(ends.flat_map(|(value, se)| [value - se, value + se, 0.0]), false, None);
    for (index, name) in chart.panels.iter().enumerate() {
        let left = margin + panel * index as f64;
        let middle = left + 0.5 * (panel - 2.0 * BORDER);
        canvas.text((middle, top - 0.8 * HEADING), name, heading.anchored(Anchor::Middle));
        let frame = BarFrame {
            at: (left, top),
            size: (panel - 2.0 * BORDER, height),
            axis,
        };
        frame.draw(&mut canvas, chart, index, row);
    }
    for (index, entry) in chart.rows.iter().enumerate() {
        let style = TextStyle::new(SIZE, INK).anchored(Anchor::End);
        let style = if entry.heading { style.bold() } else { style };
        let y = top + row * (index as f64 + 0.5);
        canvas.text((margin - BORDER, y), &entry.label, style);
    }
    legend(&mut canvas, chart, top + height + FOOT - 20.0, width);
    canvas
}

/// One panel.
struct BarFrame {
    at: Point,
    size: Point,
    axis: Axis,
}

impl BarFrame {
    fn column(&self, value: f64) -> Option<f64> {
        self.axis.place(value).map(|u| self.at.0 + u * self.size.0)
    }

    fn draw(&self, canvas: &mut Canvas, chart: &BarChart, panel: usize, row: f64) {
        let ((left, top), (width, height)) = (self.at, self.size);
        let bottom = top + height;
        canvas.rect((left, top), self.size, WHITE, 1.0);
        for (index, _) in chart.rows.iter().enumerate().filter(|(_, r)| r.heading) {
            canvas.rect((left, top + row * index as f64), (width, row), GRID, 0.6);
        }
        let tick = TextStyle::new(SIZE, MUTED).anchored(Anchor::Middle);
        for (value, label) in self.axis.ticks(4) {
            let Some(x) = self.column(value) else { continue };
            canvas.line(&[(x, top), (x, bottom)], GRID, 1.0);
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], CLAIM, 1.0);
            canvas.text((x, bottom + 15.0), &label, tick);
        }
        if let Some(zero) = self.column(0.0) {
            canvas.line(&[(zero, top), (zero, bottom)], CLAIM, 1.2);
        }
        let label = TextStyle::new(SIZE, INK).anchored(Anchor::Middle);
        canvas.text((left + 0.5 * width, bottom + 34.0), &chart.x_label, label);
        for (index, entry) in chart.rows.iter().enumerate() {
            let first = top + row * index as f64 + 0.5 * GAP;
            let Some(values) = entry.values.get(panel) else {
                continue;
            };
            for (k, (value, group)) in values.iter().zip(&chart.groups).enumerate() {
                if let Some(bar) = value {
                    self.bar(canvas, *bar, first + BAR * k as f64, group.style);
                }
            }
        }
    }

    fn bar(&self, canvas: &mut Canvas, (value, se): Bar, top: f64, style: Style) {
        let place = |v: f64| self.column(v);
        let (Some(zero), Some(end)) = (place(0.0), place(value)) else {
            return;
        };
        let (left, right) = (zero.min(end), zero.max(end));
        canvas.rect((left, top), (right - left, BAR - 1.0), colour::style(style, 0), 1.0);
        if let (true, Some(low), Some(high)) = (se > 0.0, place(value - se), place(value + se)) {
            let y = top + 0.5 * (BAR - 1.0);
            canvas.line(&[(low, y), (high, y)], INK, 1.2);
            for x in [low, high] {
                canvas.line(&[(x, y - CAP), (x, y + CAP)], INK, 1.2);
            }
        }
    }
}

/// Names of the groups, in a line below the panels.
fn legend(canvas: &mut Canvas, chart: &BarChart, y: f64, width: f64) {
    const SAMPLE: f64 = 22.0;
    let wide = |group: &BarGroup| SAMPLE + 8.0 + text_width(&group.name, SIZE, false) + 2.0 * BORDER;
    let total: f64 = chart.groups.iter().map(wide).sum();
    let mut x = (0.5 * (width - total)).max(BORDER);
    for group in &chart.groups {
        canvas.items.push(Shape::Polygon {
            points: vec![
                (x, y - 0.5 * BAR),
                (x + SAMPLE, y - 0.5 * BAR),
                (x + SAMPLE, y + 0.5 * BAR),
                (x, y + 0.5 * BAR),
            ],
            fill: colour::style(group.style, 0),
            opacity: 1.0,
        });
        canvas.text((x + SAMPLE + 8.0, y), &group.name, TextStyle::new(SIZE, INK));
        x += wide(group);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn chart(values: Vec<Vec<Option<Bar>>>) -> BarChart {
        BarChart {
            title: "made up".to_owned(),
            x_label: "loss".to_owned(),
            panels: vec![String::new(); values.len()],
            groups: vec![BarGroup {
                name: "one".to_owned(),
                style: Style::Twin,
            }],
            rows: vec![BarRow {
                label: "row".to_owned(),
                heading: false,
                values,
            }],
        }
    }

    /// Left and right ends of every bar.
    fn bars(canvas: &Canvas) -> Vec<(f64, f64)> {
        let blue = colour::style(Style::Twin, 0);
        let of_item = |item: &Shape| match item {
            Shape::Polygon { points, fill, .. } if *fill == blue => Some((points[0].0, points[1].0)),
            _ => None,
        };
        canvas.items.iter().filter_map(of_item).collect()
    }

    /// Bars of 2 and −1: the second is half as long, ends where the first begins, and both share one axis in two
    /// panels.
    #[test]
    fn lengths_are_values() {
        let found = bars(&layout(&chart(vec![vec![Some((2.0, 0.0))], vec![Some((-1.0, 0.5))]])));
        // the third is the legend's sample
        assert_eq!(found.len(), 3);
        let (first, second) = (found[0], found[1]);
        assert_relative_eq!(first.1 - first.0, 2.0 * (second.1 - second.0), max_relative = 1e-12);
        // panels of 340 stand side by side, and zero at the same place in each
        assert_relative_eq!(second.1 - first.0, 340.0, max_relative = 1e-12);
    }

    #[test]
    fn what_has_no_length_is_left_out() {
        for bar in [
            None,
            Some((f64::NAN, 1.0)),
            Some((f64::INFINITY, 0.0)),
            Some((0.0, f64::NAN)),
        ] {
            let canvas = layout(&chart(vec![vec![bar], vec![]]));
            assert!(
                bars(&canvas)
                    .iter()
                    .all(|(left, right)| left.is_finite() && right.is_finite())
            );
        }
        let dir = tempfile::tempdir().unwrap();
        save_bars(&chart(vec![]), dir.path(), "none").unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }
}
