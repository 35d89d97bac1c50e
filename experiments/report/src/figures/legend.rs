//! The words of a chart: its legend, below the panels, where it never covers data; and what the paper states, stars and
//! dashed lines, with labels that keep clear of the curves.

use super::axis::PanelFrame;
use super::canvas::{Anchor, Canvas, Point, TextStyle, text_width, widest, wrap};
use super::chart::{Chart, Claim, Series};
use super::colour::{CLAIM, INK, MUTED, WHITE};
use super::looks::{Style, dash, draw_marker, ink, ring, star};

/// Opacity of a range of the paper.
pub(super) const RANGE_OPACITY: f64 = 0.18;
/// Size of the words.
const SIZE: f64 = 13.0;
/// Height of a line.
const LINE: f64 = 22.0;
/// Width of the piece of curve before the words.
const SAMPLE: f64 = 34.0;
/// Space after an entry.
const GAP: f64 = 20.0;

/// What an entry shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum LegendKey {
    /// A curve.
    Curve(Style, u8),
    /// The star of a claim.
    Star,
    /// The line of a claim.
    Dashes,
    /// The shade of a range that the paper states.
    Shade,
    /// The ring of a published system.
    Ring,
}

/// Entries of a legend in lines.
pub(super) struct Legend {
    lines: Vec<Vec<(LegendKey, String, f64)>>,
    /// Height of all lines.
    pub(super) height: f64,
}

/// What a chart's legend names, each once.
pub(super) fn entries(chart: &Chart) -> Vec<(LegendKey, String)> {
    let mut out: Vec<(LegendKey, String)> = Vec::new();
    let mut add = |key: LegendKey, name: &str| {
        let entry = (key, name.to_owned());
        if !name.is_empty() && !out.contains(&entry) {
            out.push(entry);
        }
    };
    for Series { style, variant, name, .. } in &chart.series {
        add(LegendKey::Curve(*style, variant % style.variants()), name);
    }
    for claim in &chart.claims {
        match (claim.x, claim.y) {
            (Some(_), Some(_)) => add(LegendKey::Star, "stated in the paper"),
            (None, None) => {}
            _ => add(LegendKey::Dashes, "stated in the paper"),
        }
    }
    if !chart.ranges.is_empty() {
        add(LegendKey::Shade, "range in the paper");
    }
    if !chart.published.is_empty() {
        add(LegendKey::Ring, "published, as stated");
    }
    out
}

impl Legend {
    /// Breaks the entries of a chart into lines no wider than `width`.
    pub(super) fn new(chart: &Chart, width: f64) -> Self {
        let mut lines: Vec<Vec<_>> = Vec::new();
        let mut used = f64::INFINITY;
        for (key, name) in entries(chart) {
            let wide = SAMPLE + 8.0 + text_width(&name, SIZE, false);
            if used + wide > width {
                lines.push(Vec::new());
                used = 0.0;
            }
            used += wide + GAP;
            if let Some(line) = lines.last_mut() {
                line.push((key, name, wide));
            }
        }
        let height = if lines.is_empty() { 0.0 } else { LINE * lines.len() as f64 + 6.0 };
        Self { lines, height }
    }

    /// Draws the lines, centred in `width`.
    pub(super) fn draw(&self, canvas: &mut Canvas, (left, top): Point, width: f64) {
        for (index, line) in self.lines.iter().enumerate() {
            let total = line.iter().map(|(_, _, wide)| wide + GAP).sum::<f64>() - GAP;
            let y = top + LINE * (index as f64 + 0.5);
            let mut x = left + ((width - total) / 2.0).max(0.0);
            for (key, name, wide) in line {
                let (points, middle) = (vec![(x, y), (x + SAMPLE, y)], (x + SAMPLE / 2.0, y));
                match key {
                    LegendKey::Curve(style, variant) => {
                        let (stroke, dash) = (ink(*style, *variant), dash(*style, *variant));
                        canvas.dashed(&points, stroke, 2.2, dash);
                        draw_marker(canvas, middle, *style, *variant);
                    }
                    LegendKey::Shade => canvas.rect((x, y - 7.0), (SAMPLE, 14.0), CLAIM, RANGE_OPACITY),
                    LegendKey::Star => star(canvas, middle),
                    LegendKey::Ring => ring(canvas, middle),
                    LegendKey::Dashes => {
                        canvas.dashed(&points, CLAIM, 1.6, dash(Style::Paper, 0));
                    }
                }
                canvas.text((x + SAMPLE + 8.0, y), name, TextStyle::new(SIZE, INK));
                x += wide + GAP;
            }
        }
    }
}

/// Size of the labels.
const CLAIM_SIZE: f64 = 12.5;
/// Distance between lines of a label.
const CLAIM_LINE: f64 = 16.0;
/// Distance of a label from its mark.
const CLAIM_GAP: f64 = 11.0;
/// Distance kept from curves: the reach of a marker.
const CLEAR: f64 = 5.0;
/// Widths that a label is wrapped to, in widths of the panel.
const WRAPS: [f64; 3] = [0.5, 0.34, 0.22];
/// Cost of standing on another label or outside the panel: more than all samples of the curves it could cover.
const FORBIDDEN: f64 = 1e4;

/// A claim that is inside the panel.
pub(super) struct Mark {
    label: String,
    place: Place,
    draw: fn(&mut Canvas, Point),
}

#[derive(Clone, Copy)]
enum Place {
    Point(Point),
    Level(f64),
    Column(f64),
}

/// Draws the lines, below the curves; `draw` is what draws the mark of a point later, above them.
pub(super) fn draw_marks(
    canvas: &mut Canvas,
    claims: &[Claim],
    frame: &PanelFrame,
    draw: fn(&mut Canvas, Point),
) -> Vec<Mark> {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    let mut marks = Vec::new();
    for claim in claims {
        let place = match (claim.x, claim.y) {
            (Some(x), Some(y)) => frame.place((x, y)).filter(|&place| frame.holds(place)).map(Place::Point),
            (None, Some(y)) => frame.level(y).map(Place::Level),
            (Some(x), None) => frame.column(x).map(Place::Column),
            (None, None) => None,
        };
        let Some(place) = place else { continue };
        let points = match place {
            Place::Point(_) => Vec::new(),
            Place::Level(y) => vec![(frame.left, y), (right, y)],
            Place::Column(x) => vec![(x, frame.top), (x, bottom)],
        };
        if !points.is_empty() {
            canvas.dashed(&points, CLAIM, 1.6, dash(Style::Paper, 0));
        }
        marks.push(Mark { label: claim.label.clone(), place, draw });
    }
    marks
}

/// Draws the marks of points, above the curves, and the labels where they cover least.
pub(super) fn draw_labels(canvas: &mut Canvas, marks: &[Mark], frame: &PanelFrame, busy: &[Point]) {
    let mut busy = busy.to_vec();
    let along = |at: &dyn Fn(f64) -> Point| {
        let points = (0..).map(|i| at(4.0 * f64::from(i)));
        points.take_while(|p| frame.holds(*p)).collect::<Vec<Point>>()
    };
    for mark in marks {
        match mark.place {
            Place::Point((x, y)) => {
                (mark.draw)(canvas, (x, y));
                busy.extend([-6.0, 0.0, 6.0].iter().flat_map(|&d| [(x + d, y), (x, y + d)]));
            }
            Place::Level(y) => busy.extend(along(&|far| (frame.left + far, y))),
            Place::Column(x) => busy.extend(along(&|far| (x, frame.top + far))),
        }
    }
    let mut taken: Vec<(Point, Point)> = Vec::new();
    for mark in marks {
        let cost = |corner: Point, size: Point| {
            let end = (corner.0 + size.0, corner.1 + size.1);
            let near = |p: &&Point| {
                p.0 > corner.0 - CLEAR && p.0 < end.0 + CLEAR && p.1 > corner.1 - CLEAR && p.1 < end.1 + CLEAR
            };
            let covers = busy.iter().filter(near).count();
            let outside = !frame.holds(corner) || !frame.holds(end);
            let overlaps = |(a, b): &(Point, Point)| corner.0 < b.0 && end.0 > a.0 && corner.1 < b.1 && end.1 > a.1;
            let clashes = taken.iter().any(overlaps);
            covers as f64 + FORBIDDEN * f64::from(u8::from(outside) + u8::from(clashes))
        };
        // Settings and their places come in order of preference; a later one must be better.
        let best = WRAPS
            .iter()
            .flat_map(|share| {
                let lines = wrap(&mark.label, CLAIM_SIZE, false, share * frame.width);
                let widest = widest(lines.iter().map(String::as_str), CLAIM_SIZE, false);
                let size = (widest + 6.0, CLAIM_LINE * lines.len() as f64 + 2.0);
                let places = candidates(mark.place, size, frame);
                places.into_iter().map(move |corner| (corner, size, lines.clone()))
            })
            .map(|(corner, size, lines)| (cost(corner, size), corner, size, lines))
            .reduce(|best, next| if next.0 < best.0 { next } else { best });
        if let Some((_, corner, size, lines)) = best {
            taken.push((corner, (corner.0 + size.0, corner.1 + size.1)));
            canvas.rect(corner, size, WHITE, 0.8);
            let at = (corner.0 + size.0 / 2.0, corner.1 + CLAIM_LINE / 2.0 + 1.0);
            canvas.lines(at, &lines, TextStyle::new(CLAIM_SIZE, MUTED).anchored(Anchor::Middle));
        }
    }
}

/// Upper left corners a label could have, the preferred first.
fn candidates(place: Place, (width, height): Point, frame: &PanelFrame) -> Vec<Point> {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    let slots = |from: f64, to: f64| (0..=8).map(move |i| from + (to - from) * f64::from(i) / 8.0);
    match place {
        Place::Point((x, y)) => [CLAIM_GAP, 1.8 * CLAIM_GAP, 3.0 * CLAIM_GAP]
            .iter()
            .flat_map(|gap| {
                [
                    (x + gap, y + gap / 2.0),
                    (x + gap, y - height / 2.0),
                    (x - width - gap, y - height - gap / 2.0),
                    (x - width / 2.0, y + gap),
                    (x - width / 2.0, y - height - gap),
                    (x - width - gap, y - height / 2.0),
                    (x + gap, y - height - gap / 2.0),
                    (x - width - gap, y + gap / 2.0),
                ]
            })
            .collect(),
        Place::Level(y) => {
            slots(right - width - 4.0, frame.left + 4.0).flat_map(|x| [(x, y - height - 2.0), (x, y + 2.0)]).collect()
        }
        Place::Column(x) => {
            slots(frame.top + 2.0, bottom - height - 2.0).flat_map(|y| [(x + 4.0, y), (x - width - 4.0, y)]).collect()
        }
    }
}
