//! Training data for a skin without recordings: images of random shapes pressed anywhere on it.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use spts_models::{SkinLayout, Streams, VelostatConfig};
use spts_recon::Matrix;

/// Random shapes in the prior. Their moments on 100 taxels change by less than 3 % when there are twice as many.
const SHAPES: usize = 1500;
/// Points along one side of a taxel at which a shape is sampled: its edges then fade over a taxel, as electrodes see
/// them.
const SAMPLES: usize = 3;
/// Half sizes of a shape as shares of the side of a square sheet with as many taxels.
const HALF_SIZES: [f64; 2] = [0.04, 0.4];
/// Smallest half size, taxels.
const SMALLEST: f64 = 0.7;
/// Widths of the blobs of the dictionary, taxels: standard deviations.
const WIDTHS: [f64; 2] = [0.8, 1.8];
/// With more taxels than this, the dictionary has blobs of the first width only.
const FEW_TAXELS: usize = 400;
/// Blobs end at this many standard deviations.
const REACH: f64 = 3.0;

/// Outline of a shape about its centre, in its own axes, for half sizes (a, b).
type Inside = fn(x: f64, y: f64, a: f64, b: f64) -> bool;

/// The outlines.
const OUTLINES: [Inside; 5] = [
    // ellipse
    |x, y, a, b| (x / a).powi(2) + (y / b).powi(2) <= 1.0,
    // plate
    |x, y, a, b| x.abs() <= a && y.abs() <= b,
    // ring
    |x, y, a, b| {
        let r = ((x / a).powi(2) + (y / b).powi(2)).sqrt();
        (0.55..=1.0).contains(&r)
    },
    // cross
    |x, y, a, b| (x.abs() <= a && y.abs() <= 0.3 * b) || (y.abs() <= b && x.abs() <= 0.3 * a),
    // angle
    |x, y, a, b| x.abs() <= a && y.abs() <= b && (x < -0.3 * a || y < -0.3 * b),
];

/// Images of random shapes on a skin of this layout, taxels × images; a function of `streams` alone.
pub(super) fn images(layout: &SkinLayout, streams: Streams) -> Matrix {
    let gain_log_sd = VelostatConfig::default().spread_log_sd;
    let images: Vec<Vec<f64>> = (0..SHAPES as u64)
        .map(|index| image(layout, gain_log_sd, &mut streams.rng("layout/shape", index)))
        .collect();
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    Matrix::from_column_slices(layout.taxels(), &slices)
}

/// One shape, on taxels whose gains have logarithms with the standard deviation `gain_log_sd`.
fn image(layout: &SkinLayout, gain_log_sd: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (rows, cols) = (layout.rows(), layout.cols());
    // shapes that are wider than a strip still cover a length of it
    let side = ((rows * cols) as f64).sqrt().max(2.0);
    let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let mut half = || (side * HALF_SIZES[0] * (HALF_SIZES[1] / HALF_SIZES[0]).powf(uniform(0.0, 1.0))).max(SMALLEST);
    let (a, b) = (half(), half());
    let centre = [uniform(-0.5, rows as f64 - 0.5), uniform(-0.5, cols as f64 - 0.5)];
    let (sin, cos) = uniform(0.0, std::f64::consts::TAU).sin_cos();
    #[expect(clippy::cast_possible_truncation, reason = "a small positive number")]
    let outline = OUTLINES[uniform(0.0, OUTLINES.len() as f64) as usize % OUTLINES.len()];
    let mut image = Vec::with_capacity(rows * cols);
    for row in 0..rows {
        for col in 0..cols {
            let mut covered = 0.0;
            for k in 0..SAMPLES * SAMPLES {
                let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
                let y = row as f64 + offset(k / SAMPLES) - centre[0];
                let x = col as f64 + offset(k % SAMPLES) - centre[1];
                covered += f64::from(u8::from(outline(cos * x + sin * y, cos * y - sin * x, a, b)));
            }
            // a sum of uniform numbers is nearly normal; its standard deviation is one half
            let normal: f64 = (0..3).map(|_| uniform(-0.5, 0.5)).sum::<f64>() * 2.0;
            image.push(covered / (SAMPLES * SAMPLES) as f64 * (gain_log_sd * normal).exp());
        }
    }
    image
}

/// The `images` (taxels × images) on taxels whose gains scatter as a skin's do, other ones in every image.
pub(super) fn with_gains(images: &Matrix, streams: Streams) -> Matrix {
    let gain_log_sd = VelostatConfig::default().spread_log_sd;
    let mut scattered = images.clone();
    for taxel in 0..images.nrows() {
        let mut rng = streams.rng("layout/gains", taxel as u64);
        for value in scattered.row_mut(taxel) {
            *value *= (gain_log_sd * normal(|| rng.random())).exp();
        }
    }
    scattered
}

/// A number that is nearly normal, from uniform ones in [0, 1): a sum of twelve of them has the variance 1.
fn normal(mut uniform: impl FnMut() -> f64) -> f64 {
    (0..12).map(|_| uniform() - 0.5).sum()
}

/// Dictionary of blobs at every taxel, taxels × atoms, every atom of length 1.
pub(super) fn dictionary(layout: &SkinLayout) -> Matrix {
    let (rows, cols) = (layout.rows(), layout.cols());
    let widths = if layout.taxels() > FEW_TAXELS {
        &WIDTHS[..1]
    } else {
        &WIDTHS
    };
    let mut atoms: Vec<Vec<f64>> = Vec::new();
    for width in widths {
        for centre in 0..rows * cols {
            let at = |k: usize| {
                let dr = (k / cols) as f64 - (centre / cols) as f64;
                let dc = (k % cols) as f64 - (centre % cols) as f64;
                let r = dr.hypot(dc) / width;
                if r > REACH { 0.0 } else { (-0.5 * r * r).exp() }
            };
            let atom: Vec<f64> = (0..rows * cols).map(at).collect();
            let length = atom.iter().map(|v| v * v).sum::<f64>().sqrt();
            atoms.push(atom.iter().map(|v| v / length).collect());
        }
    }
    let slices: Vec<&[f64]> = atoms.iter().map(Vec::as_slice).collect();
    Matrix::from_column_slices(rows * cols, &slices)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every taxel is covered by shapes, and atoms have length 1, on a strip and on a sheet.
    #[test]
    fn any_layout_has_images_and_atoms() {
        for (rows, cols) in [(1, 64), (12, 20), (2, 1)] {
            let layout = SkinLayout::new(rows, cols, 5e-3, 3e-3).unwrap();
            let images = images(&layout, Streams::new(1));
            assert_eq!((images.nrows(), images.ncols()), (rows * cols, SHAPES));
            for taxel in 0..rows * cols {
                let touched = images.row(taxel).iter().filter(|v| **v > 0.1).count();
                assert!(
                    touched > SHAPES / 100,
                    "{rows} × {cols}: taxel {taxel} is in {touched} shapes"
                );
            }
            let atoms = dictionary(&layout);
            for k in 0..atoms.ncols() {
                let length: f64 = atoms.column(k).iter().map(|v| v * v).sum();
                assert!((length - 1.0).abs() < 1e-12, "{length}");
            }
        }
    }
}
