//! Horizontal bars with error bars, and intervals with a mark beside each: one row a quantity, panels side by side.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, Point, TextStyle, save, text_width, widest};
use super::colour::{CLAIM, GRID, INK, MUTED, WHITE};
use super::looks::{Style, draw_marker, ink};
use spts_input::Refusal;
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
/// [`Refusal`] when a file cannot be written.
pub fn save_bars(chart: &BarChart, dir: &Path, name: &str) -> Result<(), Refusal> {
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
fn layout(chart: &BarChart) -> Canvas {
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
        let frame = BarFrame { at: (left, top), size: (panel - 2.0 * BORDER, height), axis };
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

    /// A line and a label for every tick.
    fn ticks(&self, canvas: &mut Canvas) {
        let (top, bottom) = (self.at.1, self.at.1 + self.size.1);
        for (value, label) in self.axis.ticks(4) {
            let Some(x) = self.column(value) else { continue };
            canvas.line(&[(x, top), (x, bottom)], GRID, 1.0);
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], CLAIM, 1.0);
            canvas.text((x, bottom + 15.0), &label, TextStyle::new(SIZE, MUTED).anchored(Anchor::Middle));
        }
    }

    fn draw(&self, canvas: &mut Canvas, chart: &BarChart, panel: usize, row: f64) {
        let ((left, top), (width, height)) = (self.at, self.size);
        let bottom = top + height;
        canvas.rect((left, top), self.size, WHITE, 1.0);
        for (index, _) in chart.rows.iter().enumerate().filter(|(_, r)| r.heading) {
            canvas.rect((left, top + row * index as f64), (width, row), GRID, 0.6);
        }
        self.ticks(canvas);
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
        canvas.rect((left, top), (right - left, BAR - 1.0), ink(style, 0), 1.0);
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
        canvas.rect((x, y - 0.5 * BAR), (SAMPLE, BAR), ink(group.style, 0), 1.0);
        canvas.text((x + SAMPLE + 8.0, y), &group.name, TextStyle::new(SIZE, INK));
        x += wide(group);
    }
}

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
/// [`Refusal`] when a file cannot be written.
pub fn save_intervals(chart: &IntervalChart, dir: &Path, name: &str) -> Result<(), Refusal> {
    save(&interval_layout(chart), dir, name)
}

/// Gap between panels: half a tick's label to either side.
const PANEL_GAP: f64 = 40.0;
/// Height of a row.
const ROW: f64 = 22.0;
/// Width of a panel.
const PANEL: f64 = 220.0;
/// Height of the headings of a line and of its panels.
const HEAD: f64 = 52.0;
/// Height of the ticks below.
const TICKS: f64 = 34.0;
/// Thickness of a band.
const BAND: f64 = 8.0;

/// The figure as shapes.
fn interval_layout(chart: &IntervalChart) -> Canvas {
    let margin = widest(chart.rows.iter().map(String::as_str), SIZE, false) + 2.0 * BORDER;
    let columns = chart.lines.iter().map(|line| line.panels.len()).max().unwrap_or(0);
    let (top, inner) = (3.0 * HEADING, ROW * chart.rows.len() as f64);
    let line = HEAD + inner + TICKS;
    let bottom = top + line * chart.lines.len() as f64;
    let width = margin + columns as f64 * (PANEL + PANEL_GAP);
    let mut canvas = Canvas::new(width, bottom + 2.0 * HEADING, &chart.title);
    let heading = TextStyle::new(HEADING, INK).bold();
    canvas.text((BORDER, BORDER + HEADING * 0.5), &chart.title, heading);
    let beside = TextStyle::new(SIZE, INK).anchored(Anchor::End);
    for (l, of_line) in chart.lines.iter().enumerate() {
        let y = top + line * l as f64 + HEAD;
        canvas.text((BORDER, y - 0.75 * HEAD), &of_line.title, heading);
        for (column, panel) in of_line.panels.iter().enumerate() {
            draw_panel(&mut canvas, panel, (margin + column as f64 * (PANEL + PANEL_GAP), y), inner);
        }
        for (k, label) in chart.rows.iter().enumerate() {
            canvas.text((margin - BORDER, y + ROW * (k as f64 + 0.5)), label, beside);
        }
    }
    interval_legend(&mut canvas, chart, (margin, bottom + 0.5 * HEADING));
    canvas
}

fn draw_panel(canvas: &mut Canvas, panel: &IntervalPanel, (left, top): Point, height: f64) {
    let frame = BarFrame {
        at: (left, top),
        size: (PANEL, height),
        axis: Axis::new([0.0, 1.0].into_iter(), false, Some((0.0, 1.0))),
    };
    canvas.rect(frame.at, frame.size, WHITE, 1.0);
    frame.ticks(canvas);
    canvas.frame(frame.at, frame.size, CLAIM, 1.0);
    let heading = TextStyle::new(SIZE, INK).anchored(Anchor::Middle);
    canvas.text((left + 0.5 * PANEL, top - 0.25 * HEAD), &panel.title, heading);
    for (k, i) in panel.intervals.iter().enumerate() {
        let Some(i) = i else { continue };
        let places = [i.low, i.middle, i.high, i.mark].map(|value| frame.column(value));
        let [Some(low), Some(middle), Some(high), Some(mark)] = places else {
            continue;
        };
        let y = top + ROW * (k as f64 + 0.5);
        draw_band(canvas, (low, y), (high - low).max(2.0), middle);
        // nothing is said of a band without a width
        let inside = (i.low..=i.high).contains(&i.mark) || i.low >= i.high;
        draw_marker(canvas, (mark, y), if inside { Style::Real } else { Style::Raster }, 0);
    }
}

/// A band from `left` on, with a line at its middle.
fn draw_band(canvas: &mut Canvas, (left, y): Point, width: f64, middle: f64) {
    let twin = ink(Style::Twin, 0);
    canvas.rect((left, y - 0.5 * BAND), (width, BAND), twin, 0.35);
    canvas.line(&[(middle, y - 0.8 * BAND), (middle, y + 0.8 * BAND)], twin, 2.0);
}

/// What bands and marks are, in a line.
fn interval_legend(canvas: &mut Canvas, chart: &IntervalChart, (left, y): Point) {
    let style = TextStyle::new(SIZE, INK);
    draw_band(canvas, (left, y), 24.0, left + 12.0);
    canvas.text((left + 32.0, y), &chart.legend[0], style);
    let mut x = left + 32.0 + text_width(&chart.legend[0], SIZE, false) + 2.0 * BORDER;
    let outside = format!("{}, outside the band", chart.legend[1]);
    for (marked, words) in [(Style::Real, &chart.legend[1]), (Style::Raster, &outside)] {
        draw_marker(canvas, (x, y), marked, 0);
        canvas.text((x + 12.0, y), words, style);
        x += 12.0 + text_width(words, SIZE, false) + 2.0 * BORDER;
    }
    canvas.width = canvas.width.max(x - BORDER);
}

#[cfg(test)]
mod tests {
    use super::super::colour::Rgb;
    use super::*;
    use approx::assert_relative_eq;

    /// Left and right ends of the rectangles of one colour.
    fn ends(values: Vec<Vec<Option<Bar>>>, colour: Rgb) -> Vec<(f64, f64)> {
        let chart = BarChart {
            title: "made up".to_owned(),
            x_label: "loss".to_owned(),
            panels: vec![String::new(); values.len()],
            groups: vec![BarGroup { name: "one".to_owned(), style: Style::Twin }],
            rows: vec![BarRow { label: "row".to_owned(), heading: false, values }],
        };
        let svg = layout(&chart).svg();
        let number = |line: &str, name: &str| -> f64 {
            let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        let rects = svg.lines().filter(|line| line.starts_with("<rect") && line.contains(&colour.hex()));
        rects.map(|line| (number(line, "x"), number(line, "x") + number(line, "width"))).collect()
    }

    /// The sample of the legend is a bar, too; what has no length is left out.
    #[test]
    fn lengths_are_values() {
        let twin = ink(Style::Twin, 0);
        let found = ends(vec![vec![Some((2.0, 0.0))], vec![Some((-1.0, 0.5))]], twin);
        assert_eq!(found.len(), 3);
        assert_relative_eq!(found[0].1 - found[0].0, 2.0 * (found[1].1 - found[1].0), epsilon = 0.03);
        // the two panels have one scale, so that noughts lie one panel apart
        assert_relative_eq!(found[1].1 - found[0].0, 340.0, epsilon = 0.03);
        for (bar, count) in
            [(None, 1), (Some((f64::NAN, 1.0)), 1), (Some((f64::INFINITY, 0.0)), 1), (Some((0.0, f64::NAN)), 2)]
        {
            assert_eq!(ends(vec![vec![bar], vec![]], twin).len(), count, "{bar:?}");
        }
        assert_eq!(ends(vec![], twin).len(), 1);
    }

    #[test]
    fn a_mark_outside_its_band_is_red() {
        let red = ink(Style::Raster, 0).hex();
        let count = |mark: f64| {
            let [low, middle, high] = [0.4, 0.5, 0.6];
            let chart = IntervalChart {
                title: "made up".to_owned(),
                legend: ["twin".to_owned(), "skin".to_owned()],
                rows: vec!["brain".to_owned(), "trig".to_owned()],
                lines: vec![IntervalLine {
                    title: "IoU".to_owned(),
                    panels: vec![IntervalPanel {
                        title: "M = 20".to_owned(),
                        intervals: vec![Some(Interval { low, middle, high, mark }), None],
                    }],
                }],
            };
            interval_layout(&chart).svg().matches(&red).count()
        };
        assert_eq!((count(0.5), count(0.7)), (1, 2));
    }
}
