//! The underside of a shape as a shaded picture.

use crate::figures::colour::{Rgb, WHITE};
use spts_contact::mesh::TriMesh;

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
                    let z = weights
                        .iter()
                        .zip(&corners)
                        .map(|(weight, p)| weight * p[2])
                        .sum::<f64>();
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
