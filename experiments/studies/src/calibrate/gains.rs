//! Changes of the taxels' gains between two sessions with the same object.

use super::statistics::{mean, sd};
use serde::Serialize;

/// Taxels below this share of either image's maximum are not loaded enough to have a gain.
const LOADED: f64 = 0.1;
/// Fewest loaded taxels that have a spread.
const FEWEST: usize = 3;

/// Gain of one taxel in a compressive session, relative to the raster session of the same object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TaxelGain {
    /// Taxel, from 0, row-major.
    pub taxel: usize,
    /// Ratio of compressive to raster image, divided by the geometric mean of the ratios.
    pub gain: f64,
}

/// Gains of the loaded taxels in the compressive session, relative to the raster session of the same object. The
/// contact's pressure and the taxel's fixed gain are common to both and cancel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionGains {
    /// Loaded taxels.
    pub taxels: Vec<TaxelGain>,
    /// Standard deviation of ln gain. It contains the changes of two sessions; that of one is smaller by √2.
    pub log_sd: f64,
    /// Standard error of `log_sd`: log_sd/√(2(n − 1)) for n Gaussian values.
    pub standard_error: f64,
}

/// Gains of the taxels of `compressive_v`, leaving out those in `faulty`. `None` with fewer than three loaded taxels.
pub(super) fn gains(compressive_v: &[f64], raster_v: &[f64], faulty: &[usize]) -> Option<SessionGains> {
    let limit = |image: &[f64]| LOADED * image.iter().copied().fold(0.0, f64::max);
    let (least_c, least_r) = (limit(compressive_v), limit(raster_v));
    let loaded: Vec<(usize, f64)> = compressive_v
        .iter()
        .zip(raster_v)
        .enumerate()
        .filter(|(k, (c, r))| **c > least_c && **r > least_r && !faulty.contains(k))
        .map(|(k, (c, r))| (k, (c / r).ln()))
        .collect();
    if loaded.len() < FEWEST {
        return None;
    }
    let logs: Vec<f64> = loaded.iter().map(|(_, log)| *log).collect();
    let (centre, freedom) = (mean(&logs), logs.len() as f64 - 1.0);
    let log_sd = sd(&logs) * (logs.len() as f64 / freedom).sqrt();
    let relative = |(taxel, log): (usize, f64)| TaxelGain {
        taxel,
        gain: (log - centre).exp(),
    };
    Some(SessionGains {
        taxels: loaded.into_iter().map(relative).collect(),
        log_sd,
        standard_error: log_sd / (2.0 * freedom).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_ratio_of_two_images_is_found_where_both_are_loaded() {
        let raster = [1.0, 2.0, 0.05, 1.5, 0.0, 1.0];
        // twice the raster image, times e^±0.1 on two taxels; one is faulty, one idle
        let compressive = [2.0 * 0.1_f64.exp(), 4.0, 3.0, 3.0 * (-0.1_f64).exp(), 0.0, 9.0];
        let found = gains(&compressive, &raster, &[5]).unwrap();
        let gain: Vec<f64> = found.taxels.iter().map(|t| t.gain.ln()).collect();
        for (found, expected) in gain.iter().zip([0.1, 0.0, -0.1]) {
            assert_relative_eq!(*found, expected, epsilon = 1e-12);
        }
        assert_eq!(found.taxels.iter().map(|t| t.taxel).collect::<Vec<_>>(), [0, 1, 3]);
        // (0.01 + 0 + 0.01)/2
        assert_relative_eq!(found.log_sd, 0.1, max_relative = 1e-12);
        assert_relative_eq!(found.standard_error, 0.05, max_relative = 1e-12);
        assert_eq!(gains(&compressive, &raster, &[0, 5]), None);
    }
}
