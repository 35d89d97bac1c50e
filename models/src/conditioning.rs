//! Conditioning: a taxel of Velostat conducts more from press to press of a session.

use crate::config::{ConfigError, in_range, within};
use serde::Deserialize;

/// Gain by which the conductance of a taxel is multiplied, as a function of how often the taxel has been pressed in
/// this session. Velostat conducts least at the first press, and then more with the logarithm of the number of presses.
///
/// The gain c of press k, with the slope s = [`per_ln_press`](ConditioningConfig::per_ln_press), is
///
/// c(1) = `first`·b(1), c(k) = b(k) for k > 1, where b(k) = (1 + s·ln k)/(1 + s·ln `reference_press`).
///
/// The gain is 1 at the reference press, so the static law of [`Velostat`](crate::Velostat) holds for a skin that has
/// been pressed that often. A press begins when the pressure on the taxel exceeds `touch_pa`, and ends when it falls
/// below half of `touch_pa`. The gain changes only at the beginning of a press, while the conductance is small.
///
/// ```
/// use spts_models::{Conditioning, ConditioningConfig};
///
/// let conditioning = Conditioning::try_from(ConditioningConfig::default())?;
/// let mut taxel = conditioning.fresh();
/// let first = conditioning.respond(10e3, &mut taxel);
/// conditioning.respond(0.0, &mut taxel);
/// let second = conditioning.respond(10e3, &mut taxel);
/// assert!(first < second && second < conditioning.gain(10));
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "ConditioningConfig")]
pub struct Conditioning {
    config: ConditioningConfig,
}

/// Parameters of [`Conditioning`]: in a scene, the table `[transducer_parameters.conditioning]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConditioningConfig {
    /// Extra factor of the gain at the first press. Range (0, 1]; default 0.92. With the default slope, the first press
    /// has 0.82 of the gain of the tenth (recorded: 0.64–0.96, median 0.80).
    pub first: f64,
    /// Slope s: growth of the gain for each unit of ln k, k being the number of the press. Range [0, 1]; default 0.055
    /// (recorded: 0.024–0.094).
    pub per_ln_press: f64,
    /// Press at which the gain is 1. Range [1, 1e6]; default 10, the press from which the published ground truth comes.
    pub reference_press: u32,
    /// Pressure that begins a press, Pa. Range (0, 1e9]; default 100.
    pub touch_pa: f64,
}

impl Default for ConditioningConfig {
    fn default() -> Self {
        Self {
            first: 0.92,
            per_ln_press: 0.055,
            reference_press: 10,
            touch_pa: 100.0,
        }
    }
}

impl TryFrom<ConditioningConfig> for Conditioning {
    type Error = ConfigError;
    fn try_from(c: ConditioningConfig) -> Result<Self, ConfigError> {
        in_range("conditioning.first", c.first, c.first > 0.0 && c.first <= 1.0, "(0, 1]")?;
        let slope = c.per_ln_press;
        within("conditioning.per_ln_press", slope, 0.0, 1.0, "[0, 1]")?;
        let reference = f64::from(c.reference_press);
        within("conditioning.reference_press", reference, 1.0, 1e6, "[1, 1e6]")?;
        in_range(
            "conditioning.touch_pa",
            c.touch_pa,
            c.touch_pa > 0.0 && c.touch_pa <= 1e9,
            "(0, 1e9]",
        )?;
        Ok(Self { config: c })
    }
}

/// State of one taxel: how often it has been pressed in this session, whether it is pressed now, and its gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Presses {
    count: u32,
    pressed: bool,
    gain: f64,
}

impl Conditioning {
    /// State of a taxel that has not been pressed in this session.
    #[must_use]
    pub fn fresh(&self) -> Presses {
        Presses {
            count: 0,
            pressed: false,
            gain: self.gain(1),
        }
    }

    /// Gain at press number `press` of a session, counted from 1.
    #[must_use]
    pub fn gain(&self, press: u32) -> f64 {
        let c = &self.config;
        let b = |press: u32| 1.0 + c.per_ln_press * f64::from(press.max(1)).ln();
        let first = if press <= 1 { c.first } else { 1.0 };
        first * b(press) / b(c.reference_press)
    }

    /// Tells one taxel that its pressure is now `pressure_pa`, Pa, updates its state `presses`, and returns its gain.
    pub fn respond(&self, pressure_pa: f64, presses: &mut Presses) -> f64 {
        if !presses.pressed && pressure_pa > self.config.touch_pa {
            presses.pressed = true;
            presses.count = presses.count.saturating_add(1);
            presses.gain = self.gain(presses.count);
        } else if presses.pressed && pressure_pa < 0.5 * self.config.touch_pa {
            presses.pressed = false;
        }
        presses.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn presses_are_counted_and_remembered() {
        let c = Conditioning::try_from(ConditioningConfig::default()).unwrap();
        let mut taxel = c.fresh();
        let mut gains = Vec::new();
        for _ in 0..10 {
            // wobble above half the touch pressure is the same press
            for p in [0.0, 5e3, 60.0, 5e3] {
                c.respond(p, &mut taxel);
            }
            gains.push(c.respond(5e3, &mut taxel));
        }
        assert!(gains.windows(2).all(|w| w[0] < w[1]), "{gains:?}");
        assert_relative_eq!(gains[9], 1.0);
        assert_relative_eq!(gains[0], 0.92 / (1.0 + 0.055 * 10_f64.ln()));
    }
}
