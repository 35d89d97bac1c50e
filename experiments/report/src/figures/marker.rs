//! Markers and dashes: the second way, beside colour, to tell curves apart.

use super::chart::Style;
use super::colour::{self, CLAIM, INK, Rgb, WHITE};
use super::draw::{Canvas, Point, Shape};
use super::looks;

/// Half the width of a marker.
const RADIUS: f64 = 4.2;

/// Dash and gap of a style's stroke; `None` is solid.
pub(super) fn dash(style: Style, variant: u8) -> Option<(f64, f64)> {
    match style {
        Style::Decoder => looks::stroke(variant).dash(),
        Style::Paper => Some((7.0, 4.0)),
        Style::Baseline => Some((2.2, 3.2)),
        _ => None,
    }
}

/// Draws a marker: the style chooses filled or hollow and, with the variant, the form.
pub(super) fn draw(canvas: &mut Canvas, place: Point, style: Style, variant: u8) {
    let fill = colour::style(style, variant);
    let first = match style {
        Style::Twin | Style::Real | Style::Alternative | Style::Decoder => 0,
        Style::Raster | Style::RasterReal => 1,
        Style::Baseline => 2,
        Style::Paper => 3,
    };
    let form = match style {
        Style::Decoder => looks::look(variant).1,
        Style::Alternative => [1, 0, 5, 3, 2, 4][usize::from(variant % style.variants())],
        _ => (first + variant % 4) % 4,
    };
    // A white rim separates markers that overlap.
    shape(canvas, place, form, RADIUS + 1.0, WHITE);
    shape(canvas, place, form, RADIUS, fill);
    let hollow = match style {
        Style::Real | Style::RasterReal => true,
        Style::Decoder => looks::stroke(variant).hollow(),
        _ => false,
    };
    if hollow {
        shape(canvas, place, form, RADIUS - 1.8, WHITE);
    }
}

/// A disc, square, triangle, diamond, triangle on its tip or pentagon of about the same weight.
fn shape(canvas: &mut Canvas, (x, y): Point, form: u8, radius: f64, fill: Rgb) {
    let corners: &[Point] = match form {
        0 => {
            canvas.items.push(Shape::Disc {
                centre: (x, y),
                radius,
                fill,
            });
            return;
        }
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.2), (1.15, 0.85), (-1.15, 0.85)],
        4 => &[(0.0, 1.2), (1.15, -0.85), (-1.15, -0.85)],
        5 => &[(0.0, -1.1), (1.05, -0.34), (0.65, 0.89), (-0.65, 0.89), (-1.05, -0.34)],
        _ => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
    };
    let points = corners.iter().map(|(u, v)| (x + u * radius, y + v * radius)).collect();
    canvas.items.push(Shape::Polygon {
        points,
        fill,
        opacity: 1.0,
    });
}

/// Draws the ring of what others have published.
pub(super) fn ring(canvas: &mut Canvas, centre: Point) {
    for (radius, fill) in [(RADIUS + 2.0, WHITE), (RADIUS + 1.0, INK), (RADIUS - 0.8, WHITE)] {
        canvas.items.push(Shape::Disc { centre, radius, fill });
    }
}

/// Draws the star of a claim.
pub(super) fn star(canvas: &mut Canvas, (x, y): Point) {
    for (size, fill) in [(10.5, WHITE), (8.5, CLAIM)] {
        let points = (0..10).map(|i| {
            let radius = if i % 2 == 0 { size } else { size * 0.45 };
            let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 5.0).sin_cos();
            (x + radius * sin, y - radius * cos)
        });
        canvas.items.push(Shape::Polygon {
            points: points.collect(),
            fill,
            opacity: 1.0,
        });
    }
}
