//! Signal of one pressed taxel, compared with the noise of a measurement.

use super::error::ChainError;
use super::stages::Chain;
use spts_circuit::{Constant, Mode, Profile, Readout};
use spts_models::{ConductanceMap, PressureMap, REFERENCE_PA, SkinLayout};

/// Signal and noise of one pressed taxel in a measurement of the compressive readout.
///
/// ```
/// use spts::{Chain, ChainConfig, SkinLayout};
///
/// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
/// let taxel = chain.taxel_signal()?;
/// assert!(!taxel.below_noise() && taxel.signal_v > 5.0 * taxel.step_v);
/// # Ok::<(), spts::ChainError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelSignal {
    /// Output of a taxel of median gain under 10 kPa, V.
    pub signal_v: f64,
    /// Standard deviation of a measurement of this taxel alone, V. All effects of the profile contribute, including the
    /// taxel's contact noise.
    pub noise_v: f64,
    /// Step of the converter, V; 0 if the profile has no converter.
    pub step_v: f64,
}

/// Time for which the taxel has been pressed, s: creep is over for the most part.
const HOLD_S: f64 = 0.5;
/// Measurements that the noise is found from: its standard error is 1 %.
const MEASUREMENTS: usize = 5000;
/// A taxel of less than so many standard deviations of a measurement is below the noise.
const LEAST_RATIO: f64 = 2.0;

impl TaxelSignal {
    /// Whether the signal is less than twice the noise, or less than one step of the converter. An image then needs
    /// many more measurements than there are taxels.
    #[must_use]
    pub fn below_noise(&self) -> bool {
        self.signal_v < LEAST_RATIO * self.noise_v || self.signal_v < self.step_v
    }
}

impl Chain {
    /// Signal and noise of one taxel of this skin and readout. They are measured on a skin of one taxel, without faults
    /// and with seeds by the rule, so that the result does not depend on the rows.
    ///
    /// # Errors
    /// [`ChainError`] if the readout cannot be set up.
    pub fn taxel_signal(&self) -> Result<TaxelSignal, ChainError> {
        let skin = self.skin();
        let shape = (skin.rows(), skin.cols());
        let pressure = PressureMap::from_values(shape.0, shape.1, vec![REFERENCE_PA; skin.taxels()]);
        let mut map = ConductanceMap::zeros(shape.0, shape.1);
        self.fresh_transducer().step(&pressure, HOLD_S, &mut map);
        let mut values = map.values().to_vec();
        let (_, median_s, _) = values.select_nth_unstable_by(skin.taxels() / 2, f64::total_cmp);
        let conductance = ConductanceMap::from_values(1, 1, vec![*median_s]);
        let one = SkinLayout::new(1, 1, skin.pitch_m(), skin.electrode_m()).unwrap_or_default();
        let profile = Profile {
            seeds: None,
            patterns: None,
            faults: Vec::new(),
            ..self.profile().clone()
        };
        let mut readout = Readout::new(&profile, Mode::Compressive, &one, self.streams(), 0)?;
        let volts = readout.measure(
            &mut Constant::new(conductance).map_err(ChainError::Source)?,
            MEASUREMENTS,
        )?;
        let mut weights = vec![0.0; MEASUREMENTS];
        readout.weights().fill_rows(0, &mut weights);
        let converter = readout.info().converter;
        Ok(TaxelSignal {
            signal_v: *median_s * profile.on(&one)?.volts_per_siemens(),
            noise_v: residual_sd(&weights, &volts),
            step_v: converter.map_or(0.0, |c| c.volts(0) - c.volts(1)),
        })
    }
}

/// Standard deviation of `y` about its regression on `x`.
fn residual_sd(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (x_mean, y_mean) = (mean(x), mean(y));
    let products = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - a_mean) * (b - b_mean)).sum::<f64>()
    };
    let (xx, xy) = (products(x, x_mean, x, x_mean), products(x, x_mean, y, y_mean));
    let explained = if xx > 0.0 { xy * xy / xx } else { 0.0 };
    ((products(y, y_mean, y, y_mean) - explained).max(0.0) / n).sqrt()
}
