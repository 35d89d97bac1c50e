//! The analog-to-digital converter, and the scale of the recorded volts.

use crate::batch::Batch;
use crate::converter::{CodeScale, Converter, ConverterConfig};
use crate::effect::parse;
use crate::effect::{Effect, EffectSession, ProfileError};
use serde::Deserialize;
use spts_models::{ConfigError, in_range, within};

/// Quantises to `bits` bits. The amplifier's output reaches the converter inverted through a divider:
///
/// y = `offset_v` − code · `reference_v` / (2^bits − 1) · `divider`,
///
/// The published acquisition turns codes back into volts with the same formula. Code 0 is the largest output.
///
/// ```
/// let adc: spts_circuit::Adc = toml::from_str("bits = 10\nreference_v = 3.3\ndivider = 6.67\noffset_v = 11.0")?;
/// let volts = adc.volts(adc.code(2.0));
/// assert!((volts - 2.0).abs() <= adc.lsb_v() / 2.0);
/// assert_eq!(adc.code(50.0), 0.0, "code 0 is the largest output");
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, try_from = "Config")]
pub struct Adc {
    offset_v: f64,
    lsb_v: f64,
    max_code: f64,
}

/// Parameters of [`Adc`].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Resolution, bits. Range [1, 24]; the device has 10.
    bits: u32,
    /// Full scale of the converter, V. Range [1e-3, 1e3]; the device has 3.3.
    reference_v: f64,
    /// Ratio of the amplifier's output to the voltage at the converter. Range [1e-3, 1e3].
    divider: f64,
    /// Output at code 0, V. Range [−1e6, 1e6].
    offset_v: f64,
}

impl TryFrom<Config> for Adc {
    type Error = ConfigError;
    fn try_from(c: Config) -> Result<Self, ConfigError> {
        in_range("bits", f64::from(c.bits), (1..=24).contains(&c.bits), "[1, 24]")?;
        within("reference_v", c.reference_v, 1e-3, 1e3, "[1e-3, 1e3]")?;
        within("divider", c.divider, 1e-3, 1e3, "[1e-3, 1e3]")?;
        within("offset_v", c.offset_v, -1e6, 1e6, "[−1e6, 1e6]")?;
        let max_code = f64::from((1_u32 << c.bits) - 1);
        // between 1e-6 V / 2^24 and 1e6 V: every code and every output is finite
        let lsb_v = c.reference_v / max_code * c.divider;
        in_range(
            "reference_v · divider / (2^bits − 1)",
            lsb_v,
            lsb_v.is_normal(),
            "[5e-14, 1e6]",
        )?;
        Ok(Self {
            offset_v: c.offset_v,
            lsb_v,
            max_code,
        })
    }
}

impl Adc {
    /// Size of one step, V at the amplifier's output.
    #[must_use]
    pub fn lsb_v(&self) -> f64 {
        self.lsb_v
    }

    /// Code of the output `volts`: the nearest one, limited to the valid codes. It falls as the output rises.
    #[must_use]
    #[inline]
    pub fn code(&self, volts: f64) -> f64 {
        ((self.offset_v - volts) / self.lsb_v).round().clamp(0.0, self.max_code)
    }

    /// Output that belongs to `code`, V.
    #[must_use]
    #[inline]
    pub fn volts(&self, code: f64) -> f64 {
        self.offset_v - code * self.lsb_v
    }

    /// The scale of this effect as a [`Converter`], for a recording from which `subtract_v` (if given) is subtracted
    /// before negative values are set to 0.
    ///
    /// # Errors
    /// [`ConfigError`] for a constant outside [−1e6, 1e6] V.
    pub fn converter(&self, subtract_v: Option<f64>) -> Result<Converter, ConfigError> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number below 2^24"
        )]
        let max_code = self.max_code as u32;
        Converter::new(ConverterConfig {
            offset_v: self.offset_v,
            scale: CodeScale::StepV(self.lsb_v),
            max_code,
            subtract_v,
        })
    }
}

pub(super) fn build(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    Ok(Box::new(parse::<Adc>(table)?))
}

impl Effect for Adc {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = self.volts(self.code(*y));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn adc(divider: f64, offset_v: f64) -> Adc {
        Adc::try_from(Config {
            bits: 10,
            reference_v: 3.3,
            divider,
            offset_v,
        })
        .unwrap()
    }

    #[test]
    fn steps_are_the_device_s() {
        // 3.3/1023 · 11140/570 and 3.3/1023 · 508/165 by hand, six digits
        assert_relative_eq!(adc(11140.0 / 570.0, 32.0).lsb_v(), 63.0447e-3, max_relative = 1e-6);
        assert_relative_eq!(adc(508.0 / 165.0, 4.3).lsb_v(), 9.93157e-3, max_relative = 1e-6);
    }

    #[test]
    fn every_corner_of_the_ranges_is_finite() {
        for (bits, offset_v) in [(1, -1e6), (1, 1e6), (24, -1e6), (24, 1e6)] {
            for (reference_v, divider) in [(1e-3, 1e-3), (1e-3, 1e3), (1e3, 1e-3), (1e3, 1e3)] {
                let adc = Adc::try_from(Config {
                    bits,
                    reference_v,
                    divider,
                    offset_v,
                })
                .unwrap();
                assert!(adc.lsb_v().is_normal(), "{adc:?}");
                for volts in [0.0, offset_v, f64::MAX, f64::MIN, f64::MIN_POSITIVE] {
                    assert!(adc.volts(adc.code(volts)).is_finite(), "{volts} V: {adc:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn monotone_and_within_half_a_step(a in -40.0..40.0_f64, b in -40.0..40.0_f64) {
            let adc = adc(11140.0 / 570.0, 32.0);
            let (low, high) = (a.min(b), a.max(b));
            prop_assert!(adc.code(low) >= adc.code(high));
            prop_assert!((0.0..=1023.0).contains(&adc.code(a)));
            if a.abs() < 31.9 {
                // the half step itself plus the rounding of numbers near 32
                prop_assert!((adc.volts(adc.code(a)) - a).abs() <= 0.5 * adc.lsb_v() + 32.0 * f64::EPSILON);
            }
        }
    }
}
