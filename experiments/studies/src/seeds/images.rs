//! Images that are sent through the sensing matrices.

use super::error::SeedError;
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use spts_eval::PublishedSkin;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::dictionary::{Ksvd, Selection, select};
use std::path::Path;

/// Images that the synthetic dictionary is learned from.
const TRAINING_IMAGES: u64 = 800;
/// Sweeps of its learning.
const SWEEPS: usize = 10;
/// Spread of the taxels' gains, log-standard deviation, as of the published skin.
const LOG_GAIN_SD: f64 = 0.3;
/// Width of a contact's edge, taxels: foam rounds it.
const EDGE: f64 = 0.7;

/// Images of one kind, and the dictionary that they are decoded with.
#[derive(Debug)]
pub(super) struct Images {
    /// Source of the images.
    pub(super) source: &'static str,
    /// Images, row-major.
    pub(super) images: Vec<Vec<f64>>,
    /// Dictionary, taxels × atoms.
    pub(super) dictionary: Matrix,
    /// Taxels along one side of the skin.
    pub(super) side: usize,
}

/// `count` synthetic contacts on a skin of `side` × `side` taxels, with a dictionary learned by K-SVD from others.
pub(super) fn synthetic(side: usize, count: usize, streams: Streams) -> Result<Images, SeedError> {
    let gains: Vec<f64> = {
        let mut rng = streams.rng("gains", 0);
        let log_gain = |z: f64| (LOG_GAIN_SD * z).exp();
        (0..side * side)
            .map(|_| log_gain(StandardNormal.sample(&mut rng)))
            .collect()
    };
    let draw = |label: &str, count: u64| -> Vec<Vec<f64>> {
        let one = |index| contact(side, &gains, &mut streams.rng(label, index));
        (0..count).into_par_iter().map(one).collect()
    };
    let candidates = draw("training", TRAINING_IMAGES);
    let chosen: Vec<Vec<f64>> = select(&candidates, &Selection::default())
        .into_iter()
        .map(|index| candidates[index].clone())
        .collect();
    let ksvd = Ksvd {
        n_components: side * side,
        n_iter: SWEEPS,
        ..Ksvd::default()
    };
    let dictionary = ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))?;
    Ok(Images {
        source: "synthetic",
        images: draw("images", count as u64),
        dictionary,
        side,
    })
}

/// One contact: a disc, ring, bar or angle at a random place, size and rotation, with a soft edge and a peak of .5 to 3
/// V, as the taxels' `gains` show it.
fn contact(side: usize, gains: &[f64], rng: &mut impl rand::Rng) -> Vec<f64> {
    let s = side as f64;
    let kind: u32 = rng.random_range(0..4);
    let centre = [rng.random_range(0.25..0.75) * s, rng.random_range(0.25..0.75) * s];
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::PI).sin_cos();
    let size = s * rng.random_range(0.12..0.35);
    let width = s * rng.random_range(0.05..0.12);
    let peak_v = rng.random_range(0.5..3.0);
    // signed distance to the edge, negative inside
    let distance = |row: f64, col: f64| {
        let (dx, dy) = (col + 0.5 - centre[1], row + 0.5 - centre[0]);
        let (u, v) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let bar = |u: f64, v: f64| (u.abs() - size).max(v.abs() - width);
        match kind {
            0 => u.hypot(v) - size,
            1 => (u.hypot(v) - size).abs() - width,
            2 => bar(u, v),
            _ => bar(u - size, v).min(bar(v - size, u)),
        }
    };
    let mut image: Vec<f64> = (0..side * side)
        .map(|taxel| 1.0 / (1.0 + (4.0 * distance((taxel / side) as f64, (taxel % side) as f64) / EDGE).exp()))
        .zip(gains)
        .map(|(share, gain)| share * gain)
        .collect();
    let max = image.iter().copied().fold(0.0, f64::max);
    image.iter_mut().for_each(|v| *v *= peak_v / max);
    image
}

/// Raster images of the recordings in `dir`: one a press, on the plateau, of the presses that no score looks at; and
/// the published dictionary.
///
/// # Errors
/// [`SeedError::Recordings`] when the recordings cannot be used.
pub(super) fn recorded(dir: &Path) -> Result<Images, SeedError> {
    let real = PublishedSkin::open(dir)?;
    let mut images = Vec::new();
    for session in &real.skin.sessions {
        let Some(raster) = &session.raster else { continue };
        let protocol = &session.raster_protocol;
        let scored = protocol.presses_of(raster);
        for press in (0..raster.blocks().len()).filter(|press| !scored.contains(press)) {
            let image = raster.volts(press, protocol.truth.1.min(raster.frames() - 1));
            if image.iter().all(|v| v.is_finite()) && image.iter().any(|v| *v > Selection::default().min_peak) {
                images.push(image.to_vec());
            }
        }
    }
    Ok(Images {
        source: "recorded",
        images,
        dictionary: real.skin.learned.dictionary.atoms.clone(),
        side: real.skin.learned.cols,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_recon::metrics::{SUPPORT_THRESHOLD, support};

    #[test]
    fn contacts_are_on_the_skin_and_a_function_of_the_seed() {
        let found = synthetic(8, 40, Streams::new(5)).unwrap();
        assert_eq!((found.images.len(), found.dictionary.nrows()), (40, 64));
        assert_eq!(found.images, synthetic(8, 40, Streams::new(5)).unwrap().images);
        let mut mask = Vec::new();
        for image in &found.images {
            support(image, SUPPORT_THRESHOLD, &mut mask);
            let taxels = mask.iter().filter(|on| **on).count();
            assert!((1..64).contains(&taxels), "{taxels} taxels");
            let peak = image.iter().copied().fold(0.0, f64::max);
            assert!((0.5..=3.0).contains(&peak) && image.iter().all(|v| *v >= 0.0));
        }
    }
}
