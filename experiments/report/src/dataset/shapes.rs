//! A contact sheet of procedural shapes.

use crate::figures::canvas::{Anchor, Canvas, LINE_HEIGHT, Point, TextStyle, resample, save_png, wrap};
use crate::figures::colour::{FRAME, INK, MUTED, Rgb, WHITE};
use rayon::prelude::*;
use spts_contact::mesh::TriMesh;
use spts_contact::shapes::{Shape, ShapeFamily, ShapeRanges};
use spts_input::Refusal;
use std::path::Path;

/// Shapes in a line.
const COLUMNS: usize = 8;
/// Side of a tile, CSS pixels, and m: the largest size of [`ShapeRanges::default`] fits.
const TILE: f64 = 90.0;
const MOST_M: f64 = 96e-3;
const GAP: Point = (8.0, 10.0);
const BORDER: f64 = 16.0;
/// Width of the names of families.
const NAMES: f64 = 84.0;
const TITLE: f64 = 17.0;
const WORDS: f64 = 12.0;
const CAPTION: f64 = 11.0;
/// Side of a tile in pixels of the PNG file, and points of a shape that are looked at along the side of such a pixel.
const PIXELS: usize = 180;
const OVERSAMPLING: usize = 3;
/// Length of the scale bar, m.
const BAR_M: f64 = 50e-3;
/// Marked heights of the colours, mm.
const HEIGHTS_MM: [f64; 6] = [0.0, 0.1, 0.3, 1.0, 4.0, 20.0];
/// Width of the bar of heights, and of a step of it.
const HEIGHT_BAR: f64 = 220.0;

/// Builds `count` procedural shapes in the default ranges of size, spread evenly over `families`. The shapes of each
/// family have the numbers `seed`, `seed` + 1 and so on.
///
/// # Errors
/// [`Refusal`] when a family has no solid for a number.
pub fn drawn_shapes(families: &[&ShapeFamily], seed: u64, count: usize) -> Result<Vec<Shape>, Refusal> {
    let wanted = families.iter().enumerate().flat_map(|(place, family)| {
        let more = usize::from(place < count % families.len());
        let numbers = (count / families.len() + more) as u64;
        (0..numbers).map(move |k| (*family, seed.saturating_add(k)))
    });
    let wanted: Vec<_> = wanted.collect();
    let ranges = ShapeRanges::default();
    wanted.into_par_iter().map(|(family, number)| family.build(&ranges, number)).collect()
}

/// Draws the undersides of `shapes`, those of a family together, all to one scale.
///
/// # Errors
/// [`Refusal`] when the file cannot be written.
pub fn save_shapes(shapes: &[Shape], path: &Path) -> Result<(), Refusal> {
    save_png(&layout(shapes), path)
}

/// The sheet as shapes.
pub(super) fn layout(shapes: &[Shape]) -> Canvas {
    let width = 2.0 * BORDER + NAMES + COLUMNS as f64 * (TILE + GAP.0) - GAP.0;
    let line = TILE + CAPTION * LINE_HEIGHT + GAP.1;
    let lines: Vec<&[Shape]> =
        shapes.chunk_by(|a, b| a.family == b.family).flat_map(|family| family.chunks(COLUMNS)).collect();
    let title = format!("{} procedural shapes from below", shapes.len());
    let words = "Undersides, turned as their prints on the skin are seen from above, all to one scale. Below each: its number within \
                 the family, and its size in mm. The darkest points are the lowest, which touch the skin first.";
    let words = wrap(words, WORDS, false, width - 2.0 * BORDER);
    let words_top = BORDER + TITLE * LINE_HEIGHT + 4.0;
    let keys_top = words_top + words.len() as f64 * WORDS * LINE_HEIGHT + 10.0;
    let top = keys_top + 46.0;
    let mut canvas = Canvas::new(width, top + lines.len() as f64 * line - GAP.1 + BORDER, &title);
    canvas.text((BORDER, BORDER + 0.6 * TITLE), &title, TextStyle::new(TITLE, INK).bold());
    canvas.lines((BORDER, words_top + 0.6 * WORDS), &words, TextStyle::new(WORDS, MUTED));
    draw_keys(&mut canvas, keys_top);
    let mut above = "";
    for (shapes, k) in lines.iter().zip(0_u32..) {
        let y = top + f64::from(k) * line;
        let family = shapes.first().map_or("", |shape| shape.family);
        if family != above {
            let style = TextStyle::new(WORDS, INK).bold();
            canvas.text((BORDER, y + TILE / 2.0), family, style);
            above = family;
        }
        for (shape, column) in shapes.iter().zip(0_u32..) {
            let x = BORDER + NAMES + f64::from(column) * (TILE + GAP.0);
            draw_shape(&mut canvas, shape, (x, y));
        }
    }
    canvas
}

fn draw_shape(canvas: &mut Canvas, shape: &Shape, (x, y): Point) {
    let fine = PIXELS * OVERSAMPLING;
    let rgb = picture(&shape.mesh, fine, MOST_M / fine as f64);
    let rgb = resample(&rgb, (fine, fine), (PIXELS, PIXELS));
    canvas.picture((x, y), (TILE, TILE), (PIXELS, PIXELS), &rgb, false);
    let [width_mm, depth_mm] = shape.size_m.map(|size_m| size_m * 1e3);
    let text = format!("{} · {width_mm:.0} × {depth_mm:.0}", shape.seed);
    let middle = y + TILE + 0.5 * CAPTION * LINE_HEIGHT;
    let style = TextStyle::new(CAPTION, MUTED).anchored(Anchor::Middle);
    canvas.text((x + TILE / 2.0, middle), &text, style);
}

/// The scale bar and the bar of heights.
fn draw_keys(canvas: &mut Canvas, top: f64) {
    let style = TextStyle::new(CAPTION, INK);
    let (left, level, length) = (BORDER + NAMES, top + 10.0, BAR_M / MOST_M * TILE);
    canvas.line(&[(left, level), (left + length, level)], INK, 2.0);
    for x in [left, left + length] {
        canvas.line(&[(x, level - 5.0), (x, level + 5.0)], INK, 2.0);
    }
    let words = format!("{:.0} mm", BAR_M * 1e3);
    canvas.text((left + length / 2.0, level + 16.0), &words, style.anchored(Anchor::Middle));
    // on a whole pixel, so that steps meet without seams
    let left = (left + length + 60.0).round();
    let steps = 110_u32;
    for step in 0..steps {
        let at = f64::from(step) / f64::from(steps);
        let (x, step_w) = (left + at * HEIGHT_BAR, HEIGHT_BAR / f64::from(steps));
        canvas.rect((x, level - 6.0), (step_w, 12.0), shade(height_at(at)), 1.0);
    }
    canvas.frame((left, level - 6.0), (HEIGHT_BAR, 12.0), FRAME, 1.0);
    for height_mm in HEIGHTS_MM {
        let x = left + share(height_mm * 1e-3) * HEIGHT_BAR;
        canvas.text((x, level + 16.0), &height_mm.to_string(), style.anchored(Anchor::Middle));
    }
    canvas.text((left + HEIGHT_BAR + 14.0, level), "height above the lowest point, mm", style);
}

/// Colour of the lowest points, which touch first, and of what is [`HIGHEST_M`] above them or more.
const LOW: Rgb = Rgb(0x0a, 0x2c, 0x52);
const HIGH: Rgb = Rgb(0xd4, 0xe4, 0xf2);
/// Rim of the outline.
const RIM: Rgb = Rgb(0x2f, 0x55, 0x7d);
/// Height at which colours begin to be logarithmic, m: a tenth of a millimetre is a pressure that the skin feels.
const LINEAR_M: f64 = 0.1e-3;
/// Height at the bright end of the colours, m; the rims of the roundest domes are as high.
const HIGHEST_M: f64 = 20e-3;
/// Steps of the colours: few enough that the edges between them are seen as contour lines.
const STEPS: f64 = 24.0;

/// Colour of a point that is `height_m` above the lowest one.
pub(super) fn shade(height_m: f64) -> Rgb {
    LOW.mix(HIGH, (share(height_m) * STEPS).floor() / STEPS)
}

/// Place of a height on the scale of colours, 0 to 1.
pub(super) fn share(height_m: f64) -> f64 {
    let share = (height_m.max(0.0) / LINEAR_M).ln_1p() / (HIGHEST_M / LINEAR_M).ln_1p();
    share.min(1.0)
}

/// The height at a place on the scale of colours, m.
pub(super) fn height_at(share: f64) -> f64 {
    LINEAR_M * (share * (HIGHEST_M / LINEAR_M).ln_1p()).exp_m1()
}

/// A square picture of the underside of `mesh`, `side` pixels of `pixel_m` metres wide, with the middle of its box in
/// the middle: x to the right and y up, as its print on the skin is seen from above. Red, green, blue of every pixel.
pub(super) fn picture(mesh: &TriMesh, side: usize, pixel_m: f64) -> Vec<u8> {
    let heights_m = heights(mesh, side, pixel_m);
    let is_rim = |k: usize| {
        let (row, col) = (k / side, k % side);
        // two pixels deep, since the picture is shrunk afterwards
        let outside = |row: Option<usize>, col: Option<usize>| match (row, col) {
            (Some(row), Some(col)) if row < side && col < side => heights_m[row * side + col].is_nan(),
            _ => true,
        };
        [1, 2].into_iter().any(|d| {
            outside(row.checked_sub(d), Some(col))
                || outside(Some(row + d), Some(col))
                || outside(Some(row), col.checked_sub(d))
                || outside(Some(row), Some(col + d))
        })
    };
    let colours = heights_m.iter().enumerate().map(|(k, height_m)| match height_m {
        height_m if height_m.is_nan() => WHITE,
        _ if is_rim(k) => RIM,
        height_m => shade(*height_m),
    });
    colours.flat_map(|Rgb(r, g, b)| [r, g, b]).collect()
}

/// Height of the lowest point of `mesh` over the middle of every pixel, m; NaN where there is none.
fn heights(mesh: &TriMesh, side: usize, pixel_m: f64) -> Vec<f64> {
    let mut heights_m = vec![f64::NAN; side * side];
    let Some((low, high)) = mesh.bounds() else {
        return heights_m;
    };
    let middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
    let half = 0.5 * side as f64;
    for t in 0..mesh.triangles.len() {
        if mesh.area_vector_m2(t)[2] >= 0.0 {
            continue;
        }
        // columns, rows and heights
        let corners = mesh.corners(t).map(|[x, y, z]| {
            let across = half + (x - middle[0]) / pixel_m;
            [across, half - (y - middle[1]) / pixel_m, z - low[2]]
        });
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let range = |k: usize| {
            let of = |pick: fn(f64, f64) -> f64| corners[1..].iter().fold(a[k], |found, p| pick(found, p[k]));
            pixel(of(f64::min), side)..pixel(of(f64::max).ceil(), side)
        };
        for row in range(1) {
            for col in range(0) {
                let (x, y) = (col as f64 + 0.5, row as f64 + 0.5);
                let weight = |p: [f64; 3], q: [f64; 3]| ((p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x)) / area;
                let weights = [weight(b, c), weight(c, a), weight(a, b)];
                if weights.iter().all(|weight| *weight >= 0.0) {
                    let z = weights.iter().zip(&corners).map(|(weight, p)| weight * p[2]).sum::<f64>();
                    let held = &mut heights_m[row * side + col];
                    // the lower one; NaN gives way
                    *held = held.min(z);
                }
            }
        }
    }
    heights_m
}

/// A pixel of a coordinate, clamped to `0..=side`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
fn pixel(value: f64, side: usize) -> usize {
    (value.floor() as usize).min(side)
}
