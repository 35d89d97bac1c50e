//! The gains of a skin's taxels, from raster images of it and of the same contacts on a median skin.

use crate::session::ScoredSession;
use spts_circuit::{Block, RecordingError};
use spts_models::VelostatConfig;
use spts_recon::classify::Library;

/// Standard deviation of the logarithm of what a simulated contact is wrong by on one taxel, independent from object to
/// object (`scripts/fit_objects.py` fits its gains with the same).
const CONTACT_LOG_SD: f64 = 0.35;
/// A taxel takes part where the simulated image is above this share of its maximum: elsewhere a small shift of an edge
/// makes any ratio.
const TOUCHED: f64 = 0.35;
/// No contact is believed to tell more than this factor about one taxel.
const LARGEST_FACTOR: f64 = 4.0;

/// Gain of every taxel of a skin.
#[derive(Debug, Clone, PartialEq)]
pub struct GainMap {
    /// Gain, median 1, taxel by taxel.
    pub gains: Vec<f64>,
    /// Standard deviation that is left of a gain's logarithm: its root mean square over the taxels, each weighted by
    /// the number of contacts that touch it.
    pub log_sd: f64,
}

/// Why a skin has no gains.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GainMapError {
    /// No object is in both sets of images.
    #[error("no object has both an image of the skin and a simulated one")]
    NoPair,
    /// Images of different sizes.
    #[error("images of the skin have {skin} taxels, simulated ones {simulated}")]
    Shape {
        /// Taxels of the skin.
        skin: usize,
        /// Taxels of the simulation.
        simulated: usize,
    },
}

impl GainMap {
    /// Gains of the skin that `skin` shows, of which `simulated` shows the contacts at gain 1: one image a label each.
    /// Labels that are not in both are not used.
    ///
    /// log g is the ridge regression of log(vᵢ / s mᵢ), v the image of the skin, m the simulated one and s the ratio of
    /// their sums over the taxels that m touches: Σ log(v/sm) / (n + σ꜀²/σ²) over the n objects that touch the taxel,
    /// which is the posterior mean for gains of log-sd σ (the transducer's spread) and errors of log-sd σ꜀ = 0.35 in a
    /// contact; what is left is σ꜀/√(n + σ꜀²/σ²).
    ///
    /// # Errors
    /// [`GainMapError`] when no label is in both, or the images differ in size.
    pub fn estimate(skin: &Library, simulated: &Library) -> Result<Self, GainMapError> {
        let taxels = skin.images().nrows();
        if taxels != simulated.images().nrows() {
            return Err(GainMapError::Shape {
                skin: taxels,
                simulated: simulated.images().nrows(),
            });
        }
        let (mut total, mut count, mut pairs) = (vec![0.0; taxels], vec![0.0; taxels], 0);
        for (k, label) in skin.labels().iter().enumerate() {
            let Some(l) = simulated.labels().iter().position(|s| s == label) else {
                continue;
            };
            pairs += 1;
            for (i, log) in logs(&skin.images().column(k), &simulated.images().column(l)) {
                total[i] += log;
                count[i] += 1.0;
            }
        }
        if pairs == 0 {
            return Err(GainMapError::NoPair);
        }
        let ridge = (CONTACT_LOG_SD / VelostatConfig::default().spread_log_sd).powi(2);
        let gains = total.iter().zip(&count).map(|(t, n)| (t / (n + ridge)).exp());
        let left = |n: &f64| n * CONTACT_LOG_SD.powi(2) / (n + ridge);
        let touches = count.iter().sum::<f64>().max(1.0);
        let log_sd = (count.iter().map(left).sum::<f64>() / touches).sqrt();
        Ok(Self {
            gains: gains.collect(),
            log_sd,
        })
    }

    /// γ: relative standard deviation that is left of a gain in one session, with the transducer's own spread of
    /// sessions.
    #[must_use]
    pub fn gain_sd(&self) -> f64 {
        relative_sd(self.log_sd.hypot(VelostatConfig::default().session_log_sd))
    }

    /// The raster sessions as this skin would have shown them; compressive ones are left out.
    ///
    /// # Errors
    /// [`RecordingError`] when a gain makes a sample infinite.
    pub fn applied(&self, sessions: &[ScoredSession]) -> Result<Vec<ScoredSession>, RecordingError> {
        let with_gains = |session: &ScoredSession| {
            let Some(raster) = &session.raster else {
                return Ok(session.clone());
            };
            let blocks = raster.blocks().iter().map(|block| Block {
                frame_position: block.frame_position,
                idle_frames: block.idle_frames,
                volts: block
                    .volts
                    .iter()
                    .zip(self.gains.iter().cycle())
                    .map(|(v, g)| v * g)
                    .collect(),
            });
            Ok(ScoredSession {
                raster: Some(raster.with_blocks(blocks.collect())?),
                compressive: None,
                ..session.clone()
            })
        };
        sessions.iter().map(with_gains).collect()
    }
}

/// Logarithm of the ratio of the images on the taxels that the simulated one touches, both scaled to the same sum
/// there.
fn logs(skin: &[f64], simulated: &[f64]) -> Vec<(usize, f64)> {
    let threshold = TOUCHED * simulated.iter().copied().fold(0.0, f64::max);
    let touched: Vec<usize> = (0..skin.len()).filter(|&i| simulated[i] > threshold).collect();
    let sum = |image: &[f64]| touched.iter().map(|&i| image[i].max(0.0)).sum::<f64>();
    let scale = sum(skin) / sum(simulated);
    let log = |&i: &usize| {
        let ratio = skin[i].max(0.0) / (scale * simulated[i]);
        (i, ratio.clamp(1.0 / LARGEST_FACTOR, LARGEST_FACTOR).ln())
    };
    if scale > 0.0 && scale.is_finite() {
        touched.iter().map(log).collect()
    } else {
        Vec::new()
    }
}

/// γ of a skin that is none of the usual simulated ones: relative standard deviation of its taxels' log-normal gains in
/// one session, √(exp(σ² + σₛ²) − 1) with σ = `spread_log_sd` and σₛ = `session_log_sd` as the transducer has them.
#[must_use]
pub fn simulated_gain_sd() -> f64 {
    let sheet = VelostatConfig::default();
    relative_sd(sheet.spread_log_sd.hypot(sheet.session_log_sd))
}

/// Relative standard deviation √(exp(σ²) − 1) of a log-normal value whose logarithm has the standard deviation σ =
/// `log_sd`.
fn relative_sd(log_sd: f64) -> f64 {
    (log_sd * log_sd).exp_m1().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_recon::Matrix;

    fn library(images: &[&[f64]]) -> Library {
        let labels: Vec<usize> = (1..=images.len()).collect();
        Library::new(&Matrix::from_column_slices(3, images), &labels).unwrap()
    }

    /// Two objects on two taxels whose gains are e^±a: with n = 2 and ratios that are exact, the estimate is a · 2/(2 +
    /// σ꜀²/σ²).
    #[test]
    fn gains_shrink_as_the_regression_says() {
        let a = 0.2_f64;
        // equal sums, so that the scale is 1/cosh a and cancels in the ratio of the two taxels
        let simulated = library(&[&[1.0, 1.0, 0.0], &[2.0, 2.0, 0.0]]);
        let skin = library(&[&[a.exp(), (-a).exp(), 0.0], &[a.exp(), (-a).exp(), 0.5]]);
        let map = GainMap::estimate(&skin, &simulated).unwrap();
        let ridge = (0.35_f64 / 0.30).powi(2);
        let expected = 2.0 * a * 2.0 / (2.0 + ridge);
        let got = (map.gains[0] / map.gains[1]).ln();
        assert!((got - expected).abs() < 1e-14, "{got}, expected {expected}");
        assert!((map.gains[2] - 1.0).abs() < 1e-15, "nothing has touched it");
        // the third taxel counts for nothing
        let left = 0.35 / (2.0 + ridge).sqrt();
        assert!((map.log_sd - left).abs() < 1e-14, "{}, expected {left}", map.log_sd);
    }

    #[test]
    fn what_has_no_pair_is_refused() {
        let one = library(&[&[1.0, 0.0, 0.0]]);
        let other = Library::new(&Matrix::from_column_slices(3, &[&[1.0, 0.0, 0.0]]), &[7]).unwrap();
        assert_eq!(GainMap::estimate(&one, &other), Err(GainMapError::NoPair));
        let larger = Library::new(&Matrix::from_column_slices(4, &[&[1.0; 4]]), &[1]).unwrap();
        assert!(matches!(
            GainMap::estimate(&one, &larger),
            Err(GainMapError::Shape { .. })
        ));
    }
}
