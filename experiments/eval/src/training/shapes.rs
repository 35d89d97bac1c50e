//! Images of procedural shapes, pressed in the simulation on a skin without recordings.

use rayon::prelude::*;
use spts_dataset::{Maker, Spec};
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_recon::Matrix;

/// The data set of these shapes.
pub const SHAPES_SPEC: &str = "unseen-shapes";
/// Presses for a sheet of 100 taxels: four hundred for each of the thirty clusters of a mixture.
const PRESSES: u64 = 12_000;
/// Taxels times presses are as many as on 100 taxels: moments take the square of the taxels.
const VALUES: u64 = 100 * PRESSES;
/// Fewest presses, on sheets of any size.
const FEWEST: u64 = 1_500;
/// Presses that one maker makes: neighbours share a shape.
const CHUNK: u64 = 50;

/// Why shapes cannot be pressed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShapesError {
    /// No data set can be made for the layout, or a shape cannot be pressed.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

/// Images of a skin of this `layout` (taxels × presses) under the shapes of [`SHAPES_SPEC`], with equal gains of all
/// taxels, each scaled to a maximum of 1. The result depends only on the layout and `seed`.
///
/// # Errors
/// [`ShapesError`] if the layout is too large.
pub fn shape_images(layout: &SkinLayout, seed: u64) -> Result<Matrix, ShapesError> {
    let presses = (VALUES / layout.taxels().max(1) as u64).clamp(FEWEST, PRESSES);
    let skin: toml::Table = [
        ("rows".to_owned(), toml::Value::Integer(layout.rows() as i64)),
        ("cols".to_owned(), toml::Value::Integer(layout.cols() as i64)),
        ("pitch_m".to_owned(), layout.pitch_m().into()),
        ("electrode_m".to_owned(), layout.electrode_m().into()),
    ]
    .into_iter()
    .collect();
    let overrides: toml::Table = [
        ("rows".to_owned(), toml::Value::Integer(presses as i64)),
        ("seed".to_owned(), toml::Value::Integer((seed >> 2) as i64)),
        ("skin".to_owned(), skin.into()),
    ]
    .into_iter()
    .collect();
    let spec = Spec::load(SHAPES_SPEC, &overrides)?;
    let chunks: Vec<Vec<Vec<f64>>> = (0..presses.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut maker = Maker::new(&spec);
            let rows = chunk * CHUNK..((chunk + 1) * CHUNK).min(presses);
            rows.map(|row| Ok(scaled(maker.row(row)?.conductance().values())))
                .collect()
        })
        .collect::<Result<_, ShapesError>>()?;
    let columns: Vec<&[f64]> = chunks.iter().flatten().map(Vec::as_slice).collect();
    Ok(Matrix::from_column_slices(layout.taxels(), &columns))
}

/// The image with a maximum of 1; of zeros where nothing is touched.
pub(super) fn scaled(image: &[f64]) -> Vec<f64> {
    let peak = image.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    image.iter().map(|v| v / peak).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every taxel of the middle is in many shapes, and the seed decides.
    #[test]
    fn shapes_cover_a_skin_of_any_layout() {
        for (rows, cols, pitch_m) in [(10, 10, 0.015), (6, 14, 0.01)] {
            let layout = SkinLayout::new(rows, cols, pitch_m, SkinLayout::usual_electrode_m(pitch_m)).unwrap();
            let images = shape_images(&layout, 1).unwrap();
            assert_eq!(images.nrows(), rows * cols);
            let middle = images.row(rows / 2 * cols + cols / 2);
            let touched = middle.iter().filter(|g| **g > 0.0).count();
            assert!(
                touched > images.ncols() / 4,
                "{rows} × {cols}: {touched} of {}",
                images.ncols()
            );
        }
    }
}
