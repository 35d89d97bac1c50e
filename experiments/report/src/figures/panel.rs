//! Charts as figures: where the panels stand, and what each shows.

use super::axis::{Axis, PanelFrame};
use super::canvas::{Anchor, Canvas, Point, TextStyle, save, text_width, widest, wrap};
use super::chart::{Chart, Claim, Series};
use super::colour::{CLAIM, GRID, INK, MUTED, WHITE};
use super::legend::{Legend, LegendKey, RANGE_OPACITY, draw_labels, draw_marks, entries};
use super::looks::{Style, dash, draw_marker, ink, ring, star};
use spts_input::Refusal;
use std::path::Path;

/// Size of tick labels.
const TICK: f64 = 13.0;
/// Size of axis labels.
const LABEL: f64 = 14.0;
/// Size of panel headings.
const HEADING: f64 = 15.0;
/// Free border of the figure, and half the gap between panels.
const BORDER: f64 = 12.0;
/// Width of a curve.
const STROKE: f64 = 2.2;
/// Width of the bar of a band.
const BAR: f64 = 1.4;
/// Markers on one curve at most; a longer curve carries every second, third, … one.
const MARKERS: usize = 40;

/// Writes one figure of one or several panels, side by side, to `dir/name.svg` and `dir/name.png`.
///
/// More than three panels are wrapped into rows.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn save_charts(charts: &[Chart], dir: &Path, name: &str) -> Result<(), Refusal> {
    save(&layout(charts), dir, name)
}

/// The figure as shapes.
pub(super) fn layout(charts: &[Chart]) -> Canvas {
    let (across, panel, height) = match charts.len() {
        0 | 1 => (1, 720.0, 380.0),
        2 | 4 => (2, 530.0, 320.0),
        _ => (3, 365.0, 270.0),
    };
    let description = charts.iter().map(|chart| chart.title.as_str()).collect::<Vec<_>>().join("; ");
    let width = BORDER * 2.0 + panel * across as f64;
    let inner = panel - 2.0 * BORDER;
    // what others have published may be in one panel alone; the common legend has it, too
    let curves = |chart: &Chart| -> Vec<_> {
        let entries = entries(chart).into_iter();
        entries.filter(|(key, _)| *key != LegendKey::Ring).collect()
    };
    let shared = charts.len() > 1 && charts.windows(2).all(|pair| curves(&pair[0]) == curves(&pair[1]));
    let common = charts
        .iter()
        .filter(|_| shared)
        .max_by_key(|chart| entries(chart).len())
        .map(|chart| Legend::new(chart, width - 4.0 * BORDER));
    let mut blocks = Vec::new();
    let mut top = BORDER;
    for row in charts.chunks(across) {
        let heading = |chart: &Chart| wrap(&chart.title, HEADING, true, inner);
        let lines = row.iter().map(|chart| heading(chart).len()).max().unwrap_or(0) as f64;
        let legends: Vec<_> = row.iter().map(|chart| (!shared).then(|| Legend::new(chart, inner))).collect();
        let below = legends.iter().flatten().map(|legend| legend.height).fold(0.0, f64::max);
        let plot_top = top + 1.3 * HEADING * lines + 10.0;
        for (column, (chart, legend)) in row.iter().zip(legends).enumerate() {
            let left = BORDER + panel * column as f64;
            blocks.push((chart, legend, heading(chart), (left, top, plot_top)));
        }
        top = plot_top + height + 52.0 + below + BORDER;
    }
    let mut canvas = Canvas::new(width, top.max(80.0) + common.as_ref().map_or(0.0, |c| c.height), &description);
    if charts.is_empty() {
        let style = TextStyle::new(LABEL, MUTED).anchored(Anchor::Middle);
        canvas.text((width / 2.0, 40.0), "no data", style);
    }
    for (chart, legend, heading, (left, top, plot_top)) in blocks {
        canvas.lines((left + BORDER, top + HEADING * 0.65), &heading, TextStyle::new(HEADING, INK).bold());
        let frame = draw_panel(&mut canvas, chart, (left + BORDER, plot_top), (inner, height));
        if let Some(legend) = legend {
            legend.draw(&mut canvas, (left + BORDER, frame.top + frame.height + 52.0), inner);
        }
    }
    if let Some(common) = common {
        common.draw(&mut canvas, (2.0 * BORDER, top - 4.0), width - 4.0 * BORDER);
    }
    canvas
}

/// One panel without its heading and legend.
fn draw_panel(canvas: &mut Canvas, chart: &Chart, (left, top): Point, (width, height): Point) -> PanelFrame {
    let finite =
        |(x, y): &Point| x.is_finite() && y.is_finite() && (!chart.x_log || *x > 0.0) && (!chart.y_log || *y > 0.0);
    let curves: Vec<Vec<Point>> =
        chart.series.iter().map(|series| series.points.iter().copied().filter(finite).collect()).collect();
    let claimed = |pick: fn(&Claim) -> Option<f64>| chart.claims.iter().chain(&chart.published).filter_map(pick);
    let stated = chart.ranges.iter().flat_map(|range| [range.from, range.to]);
    let x = Axis::new(curves.iter().flatten().map(|p| p.0).chain(claimed(|c| c.x)).chain(stated), chart.x_log, None);
    let y = Axis::new(curves.iter().flatten().map(|p| p.1).chain(claimed(|c| c.y)), chart.y_log, chart.y_range);
    let y_ticks = y.ticks(if height > 300.0 { 6 } else { 5 });
    let widest = widest(y_ticks.iter().map(|(_, label)| label.as_str()), TICK, false);
    let margin = (widest + 34.0).ceil();
    let frame = PanelFrame { left: left + margin, top, width: width - margin - 8.0, height, x, y };
    draw_axes(canvas, chart, &frame, left, &y_ticks);

    draw_ranges(canvas, chart, &frame);
    let mut busy: Vec<Point> = Vec::new();
    let mut drawn: Vec<Vec<Point>> = Vec::new();
    for series in &chart.series {
        draw_scatter(canvas, series, &frame);
    }
    // Twin and sensor lie above the rest: baselines and claims are drawn first.
    let mut order: Vec<_> = chart.series.iter().zip(&curves).collect();
    order.sort_by_key(|(series, _)| match series.style {
        Style::Baseline => 0,
        Style::Paper => 1,
        Style::RasterReal => 2,
        Style::Raster => 3,
        Style::Real => 4,
        Style::Twin | Style::Alternative | Style::Decoder => 5,
    });
    let mut marks = draw_marks(canvas, &chart.claims, &frame, star);
    marks.extend(draw_marks(canvas, &chart.published, &frame, ring));
    for (series, points) in order {
        let places: Vec<Point> = points.iter().filter_map(|&p| frame.place(p)).collect();
        let stroke = ink(series.style, series.variant);
        let below = below(&places, &drawn);
        for piece in clip(&places, &frame) {
            busy.extend(samples(&piece));
            let dash = dash_on(below).or(dash(series.style, series.variant));
            canvas.dashed(&piece, stroke, STROKE, dash);
        }
        for bar in series.spans.iter().filter_map(|&span| bar(span, chart.y_log, &frame)) {
            canvas.line(&bar, stroke, BAR);
        }
        let stride = places.len().div_ceil(MARKERS).max(1);
        // on a curve that is drawn already, every second marker is left to it
        let stride = stride * (1 + below.min(1));
        for &place in places.iter().step_by(stride).filter(|&&place| frame.holds(place)) {
            busy.push(place);
            draw_marker(canvas, place, series.style, series.variant);
        }
        drawn.push(places);
    }
    draw_labels(canvas, &marks, &frame, &busy);
    if curves.iter().all(Vec::is_empty) {
        let middle = (frame.left + frame.width / 2.0, frame.top + frame.height / 2.0);
        canvas.text(middle, "no data", TextStyle::new(LABEL, MUTED).anchored(Anchor::Middle));
    }
    frame
}

/// The part of a band inside the frame.
fn bar((x, low, high): (f64, f64, f64), log: bool, frame: &PanelFrame) -> Option<[Point; 2]> {
    let column = frame.column(x)?;
    let (top, bottom) = (frame.top, frame.top + frame.height);
    let level = |y: f64, outside: f64| match frame.place((x, y)) {
        Some((_, level)) if !log || y > 0.0 => level.clamp(top, bottom),
        _ => outside,
    };
    Some([(column, level(low, bottom)), (column, level(high, top))])
}

/// Grid, ticks and axis labels.
fn draw_axes(canvas: &mut Canvas, chart: &Chart, frame: &PanelFrame, edge: f64, y_ticks: &[(f64, String)]) {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    canvas.rect((frame.left, frame.top), (frame.width, frame.height), WHITE, 1.0);
    let tick = TextStyle::new(TICK, MUTED);
    let mut free = f64::NEG_INFINITY;
    for (value, label) in frame.x.ticks(if frame.width > 400.0 { 8 } else { 5 }) {
        let Some(x) = frame.column(value) else { continue };
        canvas.line(&[(x, frame.top), (x, bottom)], GRID, 1.0);
        canvas.line(&[(x, bottom), (x, bottom + 5.0)], CLAIM, 1.0);
        // A label that would touch the last one is left out.
        let half = text_width(&label, TICK, false) / 2.0;
        if x - half > free {
            canvas.text((x, bottom + 15.0), &label, tick.anchored(Anchor::Middle));
            free = x + half + 4.0;
        }
    }
    for (value, label) in y_ticks {
        let Some(y) = frame.level(*value) else { continue };
        canvas.line(&[(frame.left, y), (right, y)], GRID, 1.0);
        canvas.line(&[(frame.left - 5.0, y), (frame.left, y)], CLAIM, 1.0);
        canvas.text((frame.left - 8.0, y), label, tick.anchored(Anchor::End));
    }
    canvas.line(&[(frame.left, frame.top), (frame.left, bottom), (right, bottom)], CLAIM, 1.2);
    let label = TextStyle::new(LABEL, INK).anchored(Anchor::Middle);
    canvas.text((frame.left + frame.width / 2.0, bottom + 36.0), &chart.x_label, label);
    canvas.text((edge + 8.0, frame.top + frame.height / 2.0), &chart.y_label, label.upwards());
}

/// The parts of a line inside the frame.
fn clip(points: &[Point], frame: &PanelFrame) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for edge in points.windows(2) {
        let Some((from, to)) = clip_edge(edge[0], edge[1], frame) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&from) => piece.push(to),
            _ => pieces.push(vec![from, to]),
        }
    }
    pieces
}

/// The part of an edge inside the frame.
///
/// Source: Y.-D. Liang and B. A. Barsky, "A new concept and method for line clipping", ACM ToG 3 (1984).
fn clip_edge(a: Point, b: Point, frame: &PanelFrame) -> Option<(Point, Point)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    let sides = [
        (-dx, a.0 - frame.left),
        (dx, frame.left + frame.width - a.0),
        (-dy, a.1 - frame.top),
        (dy, frame.top + frame.height - a.1),
    ];
    for (step, room) in sides {
        if step < 0.0 {
            enter = enter.max(room / step);
        } else if step > 0.0 {
            leave = leave.min(room / step);
        } else if room < 0.0 {
            return None;
        }
    }
    // An end that is not cut is kept bit by bit, so that the next edge joins it.
    let at = |t: f64, end: Point| {
        if t <= 0.0 || t >= 1.0 { end } else { (a.0 + t * dx, a.1 + t * dy) }
    };
    (enter < leave).then(|| (at(enter, a), at(leave, b)))
}

/// Places along a line, four pixels apart, for labels to keep clear of.
fn samples(points: &[Point]) -> Vec<Point> {
    let mut out = Vec::new();
    for edge in points.windows(2) {
        let (dx, dy) = (edge[1].0 - edge[0].0, edge[1].1 - edge[0].1);
        let count = (dx.hypot(dy) / 4.0).ceil().max(1.0);
        let mut step = 0.0;
        while step <= count {
            out.push((edge[0].0 + dx * step / count, edge[0].1 + dy * step / count));
            step += 1.0;
        }
    }
    out
}

/// Size of the words in a range.
const RANGE_SIZE: f64 = 12.0;
/// Distance between lines of words.
const RANGE_LINE: f64 = 15.0;
/// Opacity of the scatter about a curve.
const SCATTER_OPACITY: f64 = 0.22;

/// Draws the ranges that the paper states. The words stand at the foot of the panel, inside of a range that is wide
/// enough, or beside it where no other range is, each on lines of its own.
fn draw_ranges(canvas: &mut Canvas, chart: &Chart, frame: &PanelFrame) {
    let bottom = frame.top + frame.height;
    let mut foot = bottom - 4.0;
    for range in &chart.ranges {
        let (Some(left), Some(right)) = (column(frame, range.from), column(frame, range.to)) else {
            continue;
        };
        canvas.rect((left, frame.top), (right - left, frame.height), CLAIM, RANGE_OPACITY);
        let lines = wrap(&range.label, RANGE_SIZE, false, 0.5 * frame.width);
        let widest = widest(lines.iter().map(String::as_str), RANGE_SIZE, false);
        let others = chart.ranges.iter().filter(|other| *other != range);
        let before: Vec<f64> =
            others.filter(|other| other.to <= range.from).filter_map(|other| column(frame, other.to)).collect();
        let free = before.iter().copied().fold(frame.left, f64::max);
        let (at, anchor) = if right - left > widest + 8.0 {
            (0.5 * (left + right), Anchor::Middle)
        } else if left - free > widest + 8.0 {
            (left - 5.0, Anchor::End)
        } else {
            // no further than the frame
            ((right + 5.0).min(frame.left + frame.width - widest - 4.0), Anchor::Start)
        };
        let first = foot - RANGE_LINE * (lines.len() as f64 - 0.5);
        canvas.lines((at, first), &lines, TextStyle::new(RANGE_SIZE, MUTED).anchored(anchor));
        foot -= RANGE_LINE * lines.len() as f64 + 2.0;
    }
}

/// Place of a value on the horizontal axis, kept inside the panel.
fn column(frame: &PanelFrame, value: f64) -> Option<f64> {
    Some(frame.column(value)?.clamp(frame.left, frame.left + frame.width))
}

/// Draws the scatter about `series`.
fn draw_scatter(canvas: &mut Canvas, series: &Series, frame: &PanelFrame) {
    let (top, bottom) = (frame.top, frame.top + frame.height);
    let edge = |pick: fn(&(f64, f64, f64)) -> f64| -> Vec<Point> {
        let places = series.scatter.iter().filter_map(|row| frame.place((row.0, pick(row))));
        places.map(|(x, y)| (x, y.clamp(top, bottom))).collect()
    };
    let (low, high) = (edge(|row| row.1), edge(|row| row.2));
    if low.len() < 2 || low.len() != high.len() {
        return;
    }
    let around: Vec<Point> = low.into_iter().chain(high.into_iter().rev()).collect();
    canvas.polygon(&around, ink(series.style, series.variant), SCATTER_OPACITY);
}

/// Distance below which two curves cannot be told apart, CSS pixels.
const APART: f64 = 2.0;
/// Share of the points that must be that near.
const SHARE: f64 = 0.8;

/// Dash and gap of a curve that lies on `below` others: the gaps show what is below.
fn dash_on(below: usize) -> Option<(f64, f64)> {
    (below > 0).then_some((9.0, 9.0 + 4.0 * below as f64))
}

/// How many of `earlier` the curve `places` lies on.
fn below(places: &[Point], earlier: &[Vec<Point>]) -> usize {
    earlier.iter().filter(|other| same(places, other)).count()
}

/// Whether two curves have points at the same columns, and most of them at the same heights.
fn same(a: &[Point], b: &[Point]) -> bool {
    let near = |p: &&Point| b.iter().any(|q| (p.0 - q.0).abs() < APART && (p.1 - q.1).abs() < APART);
    a.len() > 1 && b.len() > 1 && a.iter().filter(near).count() as f64 >= SHARE * a.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_curves_are_found_and_others_are_not() {
        let line = |height: f64| -> Vec<Point> { (0..10).map(|i| (f64::from(i) * 20.0, height)).collect() };
        let drawn = [line(50.0), line(51.0), line(80.0)];
        assert_eq!(below(&line(50.0), &drawn), 2);
        assert_eq!(below(&line(60.0), &drawn), 0);
        assert_eq!(below(&[(0.0, 50.0)], &drawn), 0);
        assert!(dash_on(0).is_none() && dash_on(1).is_some());
    }
}
