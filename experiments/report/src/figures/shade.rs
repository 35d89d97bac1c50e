//! Shades below the curves: ranges that the paper states, and the scatter about a curve.

use super::chart::{Chart, Series};
use super::colour::{self, CLAIM, MUTED};
use super::draw::{Anchor, Canvas, Point, Shape, TextStyle, text_width, wrap};
use super::frame::PanelFrame;

/// Size of the words in a range.
const SIZE: f64 = 12.0;
/// Distance between lines of words.
const LINE: f64 = 15.0;
/// Opacity of a range of the paper.
pub(super) const RANGE_OPACITY: f64 = 0.18;
/// Opacity of the scatter about a curve.
const SCATTER_OPACITY: f64 = 0.22;

/// Draws the ranges that the paper states. The words stand at the foot of the panel, inside of a range that is wide
/// enough, or beside it where no other range is, each on lines of its own.
pub(super) fn draw_ranges(canvas: &mut Canvas, chart: &Chart, frame: &PanelFrame) {
    let bottom = frame.top + frame.height;
    let mut foot = bottom - 4.0;
    for range in &chart.ranges {
        let (Some(left), Some(right)) = (column(frame, range.from), column(frame, range.to)) else {
            continue;
        };
        canvas.rect((left, frame.top), (right - left, frame.height), CLAIM, RANGE_OPACITY);
        let lines = wrap(&range.label, SIZE, false, 0.5 * frame.width);
        let widest = lines.iter().map(|l| text_width(l, SIZE, false)).fold(0.0, f64::max);
        let others = chart.ranges.iter().filter(|other| *other != range);
        let before: Vec<f64> = others
            .filter(|other| other.to <= range.from)
            .filter_map(|other| column(frame, other.to))
            .collect();
        let free = before.iter().copied().fold(frame.left, f64::max);
        let (at, anchor) = if right - left > widest + 8.0 {
            (0.5 * (left + right), Anchor::Middle)
        } else if left - free > widest + 8.0 {
            (left - 5.0, Anchor::End)
        } else {
            // no further than the frame
            (
                (right + 5.0).min(frame.left + frame.width - widest - 4.0),
                Anchor::Start,
            )
        };
        let first = foot - LINE * (lines.len() as f64 - 0.5);
        canvas.lines((at, first), &lines, TextStyle::new(SIZE, MUTED).anchored(anchor));
        foot -= LINE * lines.len() as f64 + 2.0;
    }
}

/// Place of a value on the horizontal axis, kept inside the panel.
fn column(frame: &PanelFrame, value: f64) -> Option<f64> {
    Some(frame.column(value)?.clamp(frame.left, frame.left + frame.width))
}

/// Draws the scatter about `series`.
pub(super) fn draw_scatter(canvas: &mut Canvas, series: &Series, frame: &PanelFrame) {
    let (top, bottom) = (frame.top, frame.top + frame.height);
    let edge = |pick: fn(&(f64, f64, f64)) -> f64| -> Vec<Point> {
        let places = series.scatter.iter().filter_map(|row| frame.place((row.0, pick(row))));
        places.map(|(x, y)| (x, y.clamp(top, bottom))).collect()
    };
    let (low, high) = (edge(|row| row.1), edge(|row| row.2));
    if low.len() < 2 || low.len() != high.len() {
        return;
    }
    canvas.items.push(Shape::Polygon {
        points: low.into_iter().chain(high.into_iter().rev()).collect(),
        fill: colour::style(series.style, series.variant),
        opacity: SCATTER_OPACITY,
    });
}
