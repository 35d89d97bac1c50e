//! Interface of readouts.

use super::wire::HeldWire;
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::recover::{Gaussian, ImagePrior};
use std::sync::{Arc, OnceLock};

/// Shares of the taxels that readouts with a free number of measurements are tried with.
const SHARES: [f64; 6] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
/// Fewest and most measurements of those.
const MEASUREMENTS: std::ops::RangeInclusive<usize> = 5..=2000;

/// A method to read a skin over few wires, such as a raster scan or random signs; `spts readouts` compares them.
///
/// ```
/// use spts_studies::readouts::{READOUTS, readout};
///
/// assert_eq!(readout("raster").map(|line| line.label), Some("raster scan"));
/// assert_eq!(READOUTS.len(), 6);
/// ```
pub trait WireReadout: Send + Sync {
    /// Computes rows, gains and everything else that depends only on the skin.
    ///
    /// # Errors
    /// [`Refusal`] if the readout does not support this skin.
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal>;
}

/// A readout method with everything computed that depends only on the skin: it measures touches.
pub trait PreparedReadout: Send + Sync {
    /// Largest magnitude of Σ wₖ·gₖ, S, over all its measurements of a skin with the conductances `conductance_s`, idle
    /// measurements included. The feedback resistance is chosen for it.
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64;

    /// Reads the touch on `wire`. Returns one reading for every number of measurements with which this readout is
    /// tested, in increasing order; every touch has the same number of readings.
    ///
    /// # Errors
    /// [`Refusal`] if the wire cannot be measured, or an image cannot be recovered.
    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal>;
}

/// What a readout method answers for one touch and one number of measurements: the image, and how soon the touch was
/// noticed and placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Number of measurements for the image.
    pub measurements: usize,
    /// One value a taxel, in any unit.
    pub image: Vec<f64>,
    /// Mean number of measurements from the onset of the touch, at a random moment, to the first sample beyond the
    /// alarm threshold; `None` if there is no such sample.
    pub noticed: Option<f64>,
    /// Mean number of measurements from the onset until the place of the touch is known; `None` if it never is.
    pub placed: Option<f64>,
}

/// The skin that readout methods are prepared for.
pub struct ReadoutSkin {
    /// Rows, columns and pitch.
    pub layout: SkinLayout,
    /// Root of random numbers.
    pub streams: Streams,
    prior: OnceLock<Arc<Gaussian>>,
}

impl ReadoutSkin {
    /// A skin of this layout. `seed` determines the random numbers that readouts need for preparation.
    #[must_use]
    pub fn new(layout: SkinLayout, seed: u64) -> Self {
        Self {
            layout,
            streams: Streams::new(seed),
            prior: OnceLock::new(),
        }
    }

    /// Prior of the images on this skin without any recording: random shapes anywhere.
    ///
    /// # Errors
    /// [`Refusal`] for a skin of more than [`TrainingData::MOST_TAXELS`].
    pub fn prior(&self) -> Result<Arc<Gaussian>, Refusal> {
        if let Some(prior) = self.prior.get() {
            return Ok(Arc::clone(prior));
        }
        let prior = TrainingData::for_layout(&self.layout, self.streams)
            .map_err(Refusal::from_error)?
            .prior(ImagePrior::UNSEEN)
            .map_err(Refusal::from_error)?;
        Ok(Arc::clone(self.prior.get_or_init(|| prior)))
    }

    /// Numbers of measurements for a readout that can choose them: 1 to 50 % of the taxels, at least 5 and at most
    /// 2000.
    #[must_use]
    pub fn measurements(&self) -> Vec<usize> {
        #[expect(clippy::cast_possible_truncation, reason = "skins have far fewer than 2^52 taxels")]
        let rounded = |share: &f64| (share * self.layout.taxels() as f64).round() as usize;
        let counts = SHARES.iter().map(rounded);
        counts.filter(|count| MEASUREMENTS.contains(count)).collect()
    }
}

/// Mean number of measurements from the onset of a touch to the first sample beyond the alarm threshold. `beyond` says
/// of every measurement of a frame whether its sample is beyond the threshold. The frame is measured over and over, and
/// the onset is at a uniformly distributed moment, so that half a measurement passes on average before the next one
/// begins. `None` if no sample is beyond the threshold.
#[must_use]
pub fn until_noticed(beyond: &[bool]) -> Option<f64> {
    let first = beyond.iter().position(|b| *b)?;
    let count = beyond.len();
    // backwards from the first one, once around
    let (mut distance, mut sum) = (0_usize, 0_usize);
    for step in 0..count {
        let at = (first + count - step) % count;
        distance = if beyond[at] { 1 } else { distance + 1 };
        sum += distance;
    }
    Some(sum as f64 / count as f64 - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: with one sample of four beyond, 1, 2, 3 or 4 measurements, less the half that passes before the first.
    #[test]
    fn waiting_times_are_means_over_the_onset() {
        let close = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(close(until_noticed(&[false, true, false, false]), 2.0));
        assert!(close(until_noticed(&[true; 5]), 0.5));
        // (1 + 2 + 1 + 2)/4 − ½
        assert!(close(until_noticed(&[true, false, true, false]), 1.0));
        assert_eq!(until_noticed(&[false; 3]), None);
        assert_eq!(until_noticed(&[]), None);
    }

    #[test]
    fn numbers_of_measurements_are_shares_of_the_taxels() {
        let counts = |side: usize| {
            let layout = SkinLayout::with_pitch(side, side, 15e-3).unwrap();
            ReadoutSkin::new(layout, 1).measurements()
        };
        assert_eq!(counts(10), [5, 10, 20, 50]);
        assert_eq!(counts(32), [10, 20, 51, 102, 205, 512]);
        assert_eq!(counts(100), [100, 200, 500, 1000, 2000]);
    }
}
