//! Known gains of the taxels of one skin.

use crate::check::{in_interval, in_range, parsed_text};
use crate::layout::SkinLayout;
use crate::streams::Streams;
use rand_distr::{Distribution as _, StandardNormal};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;

/// Gains of the taxels of one skin, as far as they are known: an independent log-normal distribution for each taxel,
/// plus the change from session to session. `spts calibrate --skin` writes them as TOML.
///
/// ```
/// use spts_models::{Mounting, SkinLayout, Streams, TaxelGains, Velostat, VelostatConfig};
///
/// let skin = SkinLayout::new(1, 2, 0.015, 0.010)?;
/// let (log_mean, log_sd) = (vec![0.3, -0.3], vec![0.0, 0.0]);
/// let gains = TaxelGains { shape: None, log_mean, log_sd, mounting: Mounting::default() };
/// let config = VelostatConfig { gains: Some(gains), ..VelostatConfig::default() };
/// let sheet = Velostat::new(config, &skin, Streams::new(1))?;
/// let of_taxels: Vec<f64> = sheet.gains().collect();
/// assert_eq!(of_taxels, [0.3_f64.exp(), (-0.3_f64).exp()]);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaxelGains {
    /// Rows and columns of the skin, if they are known. A skin of another shape then refuses the gains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<[usize; 2]>,
    /// Mean of the natural logarithm of a taxel's gain, one value a taxel in row-major order. Range [-5, 5].
    pub log_mean: Vec<f64>,
    /// Standard deviation of the natural logarithm of a taxel's gain, one value a taxel: how uncertain the gain is.
    /// Range [0, 2].
    pub log_sd: Vec<f64>,
    /// What changes between sessions, in each of which the skin is mounted anew.
    #[serde(flatten)]
    pub mounting: Mounting,
}

/// What a new mounting of the skin changes: the logarithm of a taxel's gain by e + a·u + b·v. Every session draws an e
/// for each taxel and the slopes a and b of a plane. u and v, from -1 to 1, are the taxel's place along the rows and
/// along the columns ([`SkinLayout::share_of_half`]). All are normal with mean 0.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Mounting {
    /// Standard deviation of e. Range [0, 2].
    #[serde(rename = "mounting_log_sd")]
    pub log_sd: f64,
    /// Standard deviation of a and b, a half sheet: the foam and the sheet lie askew. Range [0, 2].
    #[serde(rename = "mounting_tilt_log_sd", default)]
    pub tilt_log_sd: f64,
}

impl Mounting {
    /// Standard deviation of the logarithm of a taxel's change: √(σ² + τ²·(u² + v²)).
    pub fn taxel_log_sd(&self, [u, v]: [f64; 2]) -> f64 {
        self.log_sd.hypot(self.tilt_log_sd * u.hypot(v))
    }

    /// Root mean square of [`Self::taxel_log_sd`] over a large sheet: √(σ² + ⅔ τ²).
    pub fn mean_log_sd(&self) -> f64 {
        self.taxel_log_sd([(2.0_f64 / 3.0).sqrt(), 0.0])
    }

    /// The factor of every taxel of `skin` in one session, exactly 1 without a spread, from standard normal numbers:
    /// one for each of the two slopes, and one for each taxel.
    pub fn factors(self, skin: &SkinLayout, slopes: [f64; 2], mut each: impl FnMut() -> f64) -> Vec<f64> {
        let [a, b] = slopes.map(|z| self.tilt_log_sd * z);
        let factor = |taxel| {
            let [u, v] = skin.share_of_half(taxel);
            (self.log_sd * each() + (a * u + b * v)).exp()
        };
        (0..skin.taxels()).map(factor).collect()
    }
}

impl TaxelGains {
    /// Reads gains from TOML text.
    ///
    /// # Errors
    /// A message that names the key of the file that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let gains: Self = parsed_text(text).map_err(|e| e.to_string())?;
        gains.check(gains.log_mean.len()).map_err(|e| e.to_string())?;
        Ok(gains)
    }

    /// Checks all values, and that there is one for each of `taxels` taxels.
    ///
    /// # Errors
    /// [`Refusal`] for another number of values than `taxels`, or for the first value outside its range.
    pub fn check(&self, taxels: usize) -> Result<(), Refusal> {
        for (field, values, range) in [("log_mean", &self.log_mean, "[-5, 5]"), ("log_sd", &self.log_sd, "[0, 2]")] {
            let count = values.len();
            in_range(
                &format!("gains.{field}.length"),
                count as f64,
                count == taxels && count > 0,
                "what a skin needs: one value a taxel",
            )?;
            for (taxel, &value) in values.iter().enumerate() {
                in_interval(&format!("gains.{field}[{taxel}]"), value, range)?;
            }
        }
        in_interval("gains.mounting_log_sd", self.mounting.log_sd, "[0, 2]")?;
        in_interval("gains.mounting_tilt_log_sd", self.mounting.tilt_log_sd, "[0, 2]")
    }

    /// Checks all values, and that they belong to `skin`.
    ///
    /// # Errors
    /// [`Refusal`] for another shape or number of taxels than those of `skin`, or for the first value outside its
    /// range.
    pub fn check_skin(&self, skin: &SkinLayout) -> Result<(), Refusal> {
        for (field, found, needed) in [
            ("gains.shape[0]", self.shape.map(|s| s[0]), skin.rows()),
            ("gains.shape[1]", self.shape.map(|s| s[1]), skin.cols()),
        ] {
            if let Some(found) = found {
                in_range(field, found as f64, found == needed, "what the skin has")?;
            }
        }
        self.check(skin.taxels())
    }

    /// The gain exp(mean + sd·z) of every taxel, in row-major order. `z` has one number a taxel: by how many standard
    /// deviations the logarithm of the taxel's gain exceeds its mean.
    pub fn at<'a>(&'a self, z: impl Iterator<Item = f64> + 'a) -> impl Iterator<Item = f64> + 'a {
        let known = self.log_mean.iter().zip(&self.log_sd);
        known.zip(z).map(|((mean, sd), z)| (mean + sd * z).exp())
    }

    /// Gains of one skin that may be this one, drawn from item `index` of the streams' purpose `label`.
    pub(crate) fn draw(&self, streams: Streams, label: &str, index: u64) -> Vec<f64> {
        let mut rng = streams.rng(label, index);
        self.at(std::iter::repeat_with(|| StandardNormal.sample(&mut rng))).collect()
    }

    /// Standard deviation of the natural logarithm of every taxel's gain in a session that was not part of the
    /// calibration, one value a taxel of `skin` in row-major order: the uncertainty of the fixed gain and the change by
    /// the mounting together.
    pub fn session_log_sd<'a>(&'a self, skin: &'a SkinLayout) -> impl Iterator<Item = f64> + 'a {
        let known = self.log_sd.iter().enumerate();
        known.map(|(taxel, sd)| sd.hypot(self.mounting.taxel_log_sd(skin.share_of_half(taxel))))
    }
}

// Differences between taxels.

/// Log-normal gains of median 1: exp(σ·z), z standard normal, σ the standard deviation of the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    log_sd: f64,
}

impl Spread {
    /// Spread with σ = `log_sd` in [0, 2]; `field` is its name in messages.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range.
    pub(crate) fn new(field: &str, log_sd: f64) -> Result<Self, Refusal> {
        in_interval(field, log_sd, "[0, 2]")?;
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

    fn two() -> TaxelGains {
        TaxelGains {
            shape: Some([1, 2]),
            log_mean: vec![0.5, -0.5],
            log_sd: vec![0.1, 0.3],
            mounting: Mounting { log_sd: 0.1, tilt_log_sd: 0.2 },
        }
    }

    /// Standard errors of n = 4000 values: σ/√n of the mean, σ/√(2n) of the standard deviation; five of each.
    #[test]
    fn draws_have_the_stated_moments() {
        let gains = two();
        let n = 4000;
        let draws: Vec<Vec<f64>> = (0..n).map(|k| gains.draw(Streams::new(3), "test", k)).collect();
        for taxel in 0..2 {
            let logs: Vec<f64> = draws.iter().map(|draw| draw[taxel].ln()).collect();
            let mean = logs.iter().sum::<f64>() / n as f64;
            let sd = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
            let (expected, spread) = (gains.log_mean[taxel], gains.log_sd[taxel]);
            assert!((mean - expected).abs() < 5.0 * spread / (n as f64).sqrt(), "{mean}");
            assert!((sd - spread).abs() < 5.0 * spread / (2.0 * n as f64).sqrt(), "{sd}");
        }
    }

    #[test]
    fn toml_is_read_again_and_what_is_wrong_is_named() {
        let text = toml::to_string(&two()).unwrap();
        assert_eq!(TaxelGains::from_toml(&text).unwrap(), two());
        let skin = |rows, cols| SkinLayout::new(rows, cols, 15e-3, 10e-3).unwrap();
        assert_eq!(two().check_skin(&skin(1, 2)), Ok(()));
        let said = two().check_skin(&skin(2, 1)).unwrap_err().to_string();
        assert_eq!(said, "`gains.shape[0]` = 1 is outside what the skin has");
        for (text, part) in [
            ("log_mean = [0.0]\nlog_sd = [0.0, 1.0]\nmounting_log_sd = 0.1", "gains.log_sd.length` = 2"),
            ("log_mean = [nan]\nlog_sd = [0.0]\nmounting_log_sd = 0.1", "gains.log_mean[0]` = NaN is outside [-5, 5]"),
            ("log_mean = [0.0]\nlog_sd = [-1.0]\nmounting_log_sd = 0.1", "gains.log_sd[0]` = -1 is outside [0, 2]"),
            ("log_mean = []\nlog_sd = []\nmounting_log_sd = 0.1", "gains.log_mean.length` = 0"),
            ("log_mean = [0.0]\nlog_sd = [0.0]", "mounting_log_sd"),
            ("log_mean = [0.0]\nlog_sd = [0.0]\nmounting_log_sd = 0.1\nmean = 2", "mean"),
            ("log_mean = [0.0]\nlog_sd = [0.0]\nmounting_log_sd = 0.1\nmounting_tilt_log_sd = 3.0", "[0, 2]"),
        ] {
            let said = TaxelGains::from_toml(text).unwrap_err();
            assert!(said.contains(part), "{said}");
        }
    }

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

    /// Two taxels at u = ±1/2, v = 0 with the slope a: e^{±a/2}; their deviation is √(σ² + τ²/4).
    #[test]
    fn a_mounting_tilts_the_sheet() {
        let skin = SkinLayout::new(2, 1, 15e-3, 10e-3).unwrap();
        let mounting = Mounting { log_sd: 0.3, tilt_log_sd: 0.2 };
        let found = mounting.factors(&skin, [2.0, 1.0], || 0.0);
        assert_relative_eq!(found[0], (-0.2_f64).exp(), max_relative = 1e-15);
        assert_relative_eq!(found[1], 0.2_f64.exp(), max_relative = 1e-15);
        let sd = mounting.taxel_log_sd(skin.share_of_half(0));
        assert_relative_eq!(sd, (0.09_f64 + 0.01).sqrt(), max_relative = 1e-15);
    }

    #[test]
    fn no_spread_is_no_change() {
        let gains = Spread::new("x", 0.0).unwrap().gains(10, Streams::new(1), "x", 0);
        assert!(gains.iter().all(|g| g.to_bits() == 1.0_f64.to_bits()));
    }
}
