//! The analog-to-digital converter, and the scale between its codes and recorded volts.

use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::{in_range, within};

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
#[serde(deny_unknown_fields, try_from = "AdcConfig")]
pub struct Adc {
    offset_v: f64,
    lsb_v: f64,
    max_code: f64,
}

/// Parameters of [`Adc`].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct AdcConfig {
    /// Resolution, bits. Range [1, 24]; the device has 10.
    bits: u32,
    /// Full scale of the converter, V. Range [1e-3, 1e3]; the device has 3.3.
    reference_v: f64,
    /// Ratio of the amplifier's output to the voltage at the converter. Range [1e-3, 1e3].
    divider: f64,
    /// Output at code 0, V. Range [−1e6, 1e6].
    offset_v: f64,
}

impl TryFrom<AdcConfig> for Adc {
    type Error = Refusal;
    fn try_from(c: AdcConfig) -> Result<Self, Refusal> {
        in_range("bits", f64::from(c.bits), (1..=24).contains(&c.bits), "[1, 24]")?;
        within("reference_v", c.reference_v, 1e-3, 1e3, "[1e-3, 1e3]")?;
        within("divider", c.divider, 1e-3, 1e3, "[1e-3, 1e3]")?;
        within("offset_v", c.offset_v, -1e6, 1e6, "[−1e6, 1e6]")?;
        let max_code = f64::from((1_u32 << c.bits) - 1);
        // between 1e-6 V / 2^24 and 1e6 V: every code and every output is finite
        let lsb_v = c.reference_v / max_code * c.divider;
        in_range("reference_v · divider / (2^bits − 1)", lsb_v, lsb_v.is_normal(), "[5e-14, 1e6]")?;
        Ok(Self { offset_v: c.offset_v, lsb_v, max_code })
    }
}

impl Adc {
    /// Size of one step, V at the amplifier's output.
    pub fn lsb_v(&self) -> f64 {
        self.lsb_v
    }

    /// Code of the output `volts`: the nearest one, limited to the valid codes. It falls as the output rises.
    #[inline]
    pub fn code(&self, volts: f64) -> f64 {
        ((self.offset_v - volts) / self.lsb_v).round().clamp(0.0, self.max_code)
    }

    /// Output that belongs to `code`, V.
    #[inline]
    pub fn volts(&self, code: f64) -> f64 {
        self.offset_v - code * self.lsb_v
    }

    /// The scale of this effect as a [`Converter`], for a recording from which `subtract_v` (if given) is subtracted
    /// before negative values are set to 0.
    ///
    /// # Errors
    /// [`Refusal`] for a constant outside [−1e6, 1e6] V.
    pub fn converter(&self, subtract_v: Option<f64>) -> Result<Converter, Refusal> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^24")]
        let max_code = self.max_code as u32;
        Converter::new(ConverterConfig {
            offset_v: self.offset_v,
            scale: CodeScale::StepV(self.lsb_v),
            max_code,
            subtract_v,
        })
    }
}

/// The scale by which the codes of a converter became the volts of a recording. Every voltage of the recording belongs
/// to a code, bit for bit, so a file may store codes instead of volts.
///
/// y = `offset_v` − s(code); if `subtract_v` is given, y = max(0, `offset_v` − s(code) − `subtract_v`). Codes range
/// over [0, `max_code`], and y never rises with the code.
///
/// ```
/// use spts_circuit::{CodeScale, Converter, ConverterConfig};
///
/// let converter = Converter::new(ConverterConfig {
///     offset_v: 11.0,
///     scale: CodeScale::StepV(0.0215),
///     max_code: 1023,
///     subtract_v: None,
/// })?;
/// let volts = converter.volts(300);
/// assert!((volts - 4.55).abs() < 1e-9);
/// assert_eq!(converter.code(volts), Some(300));
/// assert_eq!(converter.code(4.56), None, "between two codes");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, try_from = "ConverterConfig", into = "ConverterConfig")]
pub struct Converter(ConverterConfig);

/// Parameters of a [`Converter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConverterConfig {
    /// Output of the amplifier at code 0, V. Range [−1e6, 1e6].
    pub offset_v: f64,
    /// s: the voltage that a code subtracts from the output.
    pub scale: CodeScale,
    /// Largest code. Range [1, 2²⁴ − 1].
    pub max_code: u32,
    /// Constant that was subtracted before negative voltages were set to 0, V; `None` if neither was done. Range [−1e6,
    /// 1e6].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subtract_v: Option<f64>,
}

/// Voltage that a code subtracts from the output, V. The two forms differ only by rounding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CodeScale {
    /// code · step, V. Range of the step [5e-14, 1e6].
    StepV(f64),
    /// code / `max_code` · reference · numerator / denominator, evaluated in this order, as in the published
    /// acquisition.
    Divider {
        /// Full scale of the converter, V. Range [1e-3, 1e3].
        reference_v: f64,
        /// Numerator of the ratio of the amplifier's output to the voltage at the converter. Range [1e-3, 1e6].
        numerator: f64,
        /// Denominator of that ratio. Range [1e-3, 1e6].
        denominator: f64,
    },
}

impl TryFrom<ConverterConfig> for Converter {
    type Error = Refusal;
    fn try_from(config: ConverterConfig) -> Result<Self, Refusal> {
        Self::new(config)
    }
}

impl From<Converter> for ConverterConfig {
    fn from(converter: Converter) -> Self {
        converter.0
    }
}

impl Converter {
    /// A converter with these parameters.
    ///
    /// # Errors
    /// [`Refusal`] for a parameter outside its range.
    pub fn new(config: ConverterConfig) -> Result<Self, Refusal> {
        within("offset_v", config.offset_v, -1e6, 1e6, "[−1e6, 1e6]")?;
        within("max_code", f64::from(config.max_code), 1.0, 16_777_215.0, "[1, 2^24 − 1]")?;
        match config.scale {
            CodeScale::StepV(step_v) => within("scale.step_v", step_v, 5e-14, 1e6, "[5e-14, 1e6]")?,
            CodeScale::Divider { reference_v, numerator, denominator } => {
                within("scale.divider.reference_v", reference_v, 1e-3, 1e3, "[1e-3, 1e3]")?;
                within("scale.divider.numerator", numerator, 1e-3, 1e6, "[1e-3, 1e6]")?;
                within("scale.divider.denominator", denominator, 1e-3, 1e6, "[1e-3, 1e6]")?;
            }
        }
        if let Some(subtract_v) = config.subtract_v {
            within("subtract_v", subtract_v, -1e6, 1e6, "[−1e6, 1e6]")?;
        }
        Ok(Self(config))
    }

    /// Largest code; the smallest is 0.
    pub fn max_code(&self) -> u32 {
        self.0.max_code
    }

    /// Bytes of a code in a file: the smallest unsigned type that holds the codes and the mark of a missing sample.
    pub fn code_bytes(&self) -> usize {
        if self.max_code() < u32::from(u16::MAX) { size_of::<u16>() } else { size_of::<u32>() }
    }

    /// What is taken from every volt before negative ones are set to 0, V.
    pub(crate) fn subtracted_v(&self) -> f64 {
        self.0.subtract_v.unwrap_or(0.0)
    }

    /// Voltage in the recording for `code`.
    pub fn volts(&self, code: u32) -> f64 {
        let code = f64::from(code);
        let taken = match self.0.scale {
            CodeScale::StepV(step_v) => code * step_v,
            CodeScale::Divider { reference_v, numerator, denominator } => {
                code / f64::from(self.0.max_code) * reference_v * numerator / denominator
            }
        };
        let volts = self.0.offset_v - taken;
        self.0.subtract_v.map_or(volts, |subtract_v| (volts - subtract_v).max(0.0))
    }

    /// Smallest code whose voltage equals `volts` bit for bit; `None` if there is no such code, as for NaN.
    pub fn code(&self, volts: f64) -> Option<u32> {
        // volts never rise with the code: the first code that is not above them
        let (mut above, mut not_above) = (0, self.0.max_code);
        if self.volts(0) <= volts {
            not_above = 0;
        }
        while not_above - above > 1 {
            let middle = above + (not_above - above) / 2;
            if self.volts(middle) > volts {
                above = middle;
            } else {
                not_above = middle;
            }
        }
        (self.volts(not_above).to_bits() == volts.to_bits()).then_some(not_above)
    }

    /// Whether this converter can have made `volts`: each of them is the voltage of one of its codes, or NaN.
    pub fn made(&self, volts: &[f64]) -> bool {
        let step_v = match self.0.scale {
            CodeScale::StepV(step_v) => step_v,
            CodeScale::Divider { reference_v, numerator, denominator } => {
                reference_v * numerator / denominator / f64::from(self.0.max_code)
            }
        };
        let zero_v = self.0.offset_v - self.subtracted_v();
        volts.iter().all(|v| {
            // nearly always the nearest code, or of a voltage set to 0 the next one, which cost less than a search
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the codes")]
            let nearest = ((zero_v - v) / step_v).round().clamp(0.0, f64::from(self.0.max_code)) as u32;
            let is = |code: u32| code <= self.0.max_code && self.volts(code).to_bits() == v.to_bits();
            v.is_nan() || is(nearest) || is(nearest + 1) || self.code(*v).is_some()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn adc(divider: f64, offset_v: f64) -> Adc {
        Adc::try_from(AdcConfig { bits: 10, reference_v: 3.3, divider, offset_v }).unwrap()
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
                let adc = Adc::try_from(AdcConfig { bits, reference_v, divider, offset_v }).unwrap();
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

    fn published(offset_v: f64, numerator: f64, denominator: f64, subtract_v: Option<f64>) -> Converter {
        Converter::new(ConverterConfig {
            offset_v,
            scale: CodeScale::Divider { reference_v: 3.3, numerator, denominator },
            max_code: 1023,
            subtract_v,
        })
        .unwrap()
    }

    /// Every code comes back, or where several have 0 V the smallest of them; and so does the converter, as text.
    #[test]
    fn codes_come_back() {
        let step = Converter::new(ConverterConfig {
            offset_v: 32.0,
            scale: CodeScale::StepV(3.3 / 4095.0 * 19.5),
            max_code: 4095,
            subtract_v: None,
        });
        for converter in [
            step.unwrap(),
            published(32.0, 11140.0, 570.0, None),
            published(4.3, 508.0, 165.0, Some(-0.1)),
            published(4.3, 508.0, 165.0, Some(4.3)),
        ] {
            let text = serde_json::to_string(&converter).unwrap();
            assert_eq!(serde_json::from_str::<Converter>(&text).unwrap(), converter, "{text}");
            for code in 0..=converter.max_code() {
                let volts = converter.volts(code);
                let found = converter.code(volts).unwrap();
                assert_eq!(converter.volts(found).to_bits(), volts.to_bits());
                assert!(found == code || (found < code && volts.abs() < f64::MIN_POSITIVE), "{found}, {code}");
            }
            assert!(converter.made(&[converter.volts(1), f64::NAN]) && !converter.made(&[0.012_345]));
            assert_eq!(converter.code(f64::NAN), None);
        }
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        let text = r#"{"offset_v": 32.0, "scale": {"step_v": 0.0}, "max_code": 1023}"#;
        let said = serde_json::from_str::<Converter>(text).unwrap_err().to_string();
        assert!(said.contains("`scale.step_v` = 0 is outside [5e-14, 1e6]"), "{said}");
    }

    proptest! {
        #[test]
        fn no_other_volts_have_a_code(volts in -40.0..40.0_f64) {
            let converter = published(32.0, 11140.0, 570.0, None);
            let found = converter.code(volts).map(|code| converter.volts(code).to_bits());
            prop_assert!(found.is_none_or(|bits| bits == volts.to_bits()));
        }
    }
}
