//! What the paper states: stars and dashed lines, with labels that keep clear of the curves.

use super::chart::{Claim, Style};
use super::colour::{CLAIM, MUTED, WHITE};
use super::draw::{Anchor, Canvas, Point, Shape, TextStyle, text_width, wrap};
use super::frame::PanelFrame;
use super::marker;

/// Size of the labels.
const SIZE: f64 = 12.5;
/// Distance between lines of a label.
const LINE: f64 = 16.0;
/// Distance of a label from its mark.
const GAP: f64 = 11.0;
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
            (Some(x), Some(y)) => frame
                .place((x, y))
                .filter(|&place| frame.holds(place))
                .map(Place::Point),
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
            canvas.items.push(Shape::Line {
                points,
                stroke: CLAIM,
                width: 1.6,
                dash: marker::dash(Style::Paper, 0),
            });
        }
        marks.push(Mark {
            label: claim.label.clone(),
            place,
            draw,
        });
    }
    marks
}

/// Draws the marks of points, above the curves, and the labels where they cover least.
pub(super) fn draw_labels(canvas: &mut Canvas, marks: &[Mark], frame: &PanelFrame, busy: &[Point]) {
    let mut busy = busy.to_vec();
    for mark in marks {
        match mark.place {
            Place::Point(place) => {
                (mark.draw)(canvas, place);
                // The star and its surroundings.
                busy.extend(
                    [-6.0, 0.0, 6.0]
                        .iter()
                        .flat_map(|&d| [(place.0 + d, place.1), (place.0, place.1 + d)]),
                );
            }
            Place::Level(y) => busy.extend(
                (0..)
                    .map(|i| (frame.left + 4.0 * f64::from(i), y))
                    .take_while(|p| frame.holds(*p)),
            ),
            Place::Column(x) => busy.extend(
                (0..)
                    .map(|i| (x, frame.top + 4.0 * f64::from(i)))
                    .take_while(|p| frame.holds(*p)),
            ),
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
                let lines = wrap(&mark.label, SIZE, false, share * frame.width);
                let widths = lines.iter().map(|line| text_width(line, SIZE, false));
                let size = (widths.fold(0.0, f64::max) + 6.0, LINE * lines.len() as f64 + 2.0);
                let places = candidates(mark.place, size, frame);
                places.into_iter().map(move |corner| (corner, size, lines.clone()))
            })
            .map(|(corner, size, lines)| (cost(corner, size), corner, size, lines))
            .reduce(|best, next| if next.0 < best.0 { next } else { best });
        if let Some((_, corner, size, lines)) = best {
            taken.push((corner, (corner.0 + size.0, corner.1 + size.1)));
            canvas.rect(corner, size, WHITE, 0.8);
            let at = (corner.0 + size.0 / 2.0, corner.1 + LINE / 2.0 + 1.0);
            canvas.lines(at, &lines, TextStyle::new(SIZE, MUTED).anchored(Anchor::Middle));
        }
    }
}

/// Upper left corners a label could have, the preferred first.
fn candidates(place: Place, (width, height): Point, frame: &PanelFrame) -> Vec<Point> {
    let (right, bottom) = (frame.left + frame.width, frame.top + frame.height);
    let slots = |from: f64, to: f64| (0..=8).map(move |i| from + (to - from) * f64::from(i) / 8.0);
    match place {
        Place::Point((x, y)) => [GAP, 1.8 * GAP, 3.0 * GAP]
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
        Place::Level(y) => slots(right - width - 4.0, frame.left + 4.0)
            .flat_map(|x| [(x, y - height - 2.0), (x, y + 2.0)])
            .collect(),
        Place::Column(x) => slots(frame.top + 2.0, bottom - height - 2.0)
            .flat_map(|y| [(x + 4.0, y), (x - width - 4.0, y)])
            .collect(),
    }
}
