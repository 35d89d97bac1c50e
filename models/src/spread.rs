//! Differences between taxels.

use crate::config::{ConfigError, within};
use crate::streams::Streams;
use rand_distr::{Distribution as _, StandardNormal};

/// Log-normal gains of median 1: exp(σ·z), z standard normal, σ the standard deviation of the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    log_sd: f64,
}

impl Spread {
    /// Spread with σ = `log_sd` in [0, 2]; `field` is its name in messages.
    ///
    /// # Errors
    /// [`ConfigError`] for a value outside its range.
    pub(crate) fn new(field: &str, log_sd: f64) -> Result<Self, ConfigError> {
        within(field, log_sd, 0.0, 2.0, "[0, 2]")?;
        Ok(Self { log_sd })
    }

    /// Gains of `taxels` taxels, drawn from item `index` of the streams' purpose `label`; all exactly 1 for σ = 0.
    pub(crate) fn gains(self, taxels: usize, streams: Streams, label: &str, index: u64) -> Vec<f64> {
        let mut rng = streams.rng(label, index);
        let gain = |_| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            (self.log_sd * normal).exp()
        };
        (0..taxels).map(gain).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Standard errors of n taxels: σ/√n of the mean logarithm, σ/√(2n) of its standard deviation; five of each.
    #[test]
    fn gains_are_log_normal() {
        let gains = Spread::new("x", 0.30).unwrap().gains(10_000, Streams::new(1), "x", 0);
        let logs: Vec<f64> = gains.iter().map(|g| g.ln()).collect();
        let mean = logs.iter().sum::<f64>() / 1e4;
        let sd = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 1e4).sqrt();
        assert_relative_eq!(mean, 0.0, epsilon = 5.0 * 0.30 / 1e2);
        assert_relative_eq!(sd, 0.30, epsilon = 5.0 * 0.30 / (2e4_f64).sqrt());
    }

    #[test]
    fn no_spread_is_no_change() {
        let gains = Spread::new("x", 0.0).unwrap().gains(10, Streams::new(1), "x", 0);
        assert!(gains.iter().all(|g| g.to_bits() == 1.0_f64.to_bits()));
    }
}
