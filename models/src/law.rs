//! The static law: conductance as a function of a constant pressure.

use crate::config::{ConfigError, in_range, within};

/// Pressure at which [`VelostatConfig::reference_s`](crate::VelostatConfig::reference_s) is given, Pa.
pub const REFERENCE_PA: f64 = 10e3;

/// Power law of a saturating pressure:
///
/// G = G_ref · (S(P)/P_ref)ⁿ, S(P) = P/(1 + P/Ps), P_ref = 10 kPa.
///
/// For P ≪ Ps it is the power law A·Pⁿ with A = G_ref/P_refⁿ, as the resistance R = a·P⁻ᵇ of force-sensing resistors is
/// usually written. Saturating the pressure, rather than dividing the power law by (1 + P/Ps), keeps the law monotone
/// for every n < 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PressureLaw {
    reference_s: f64,
    exponent: f64,
    saturation_pa: f64,
}

impl PressureLaw {
    /// Law with G_ref in (0, 1] S, n in [0.05, 2] and Ps in [1, 1e12] Pa.
    ///
    /// # Errors
    /// [`ConfigError`] for a value outside its range.
    pub(crate) fn new(reference_s: f64, exponent: f64, saturation_pa: f64) -> Result<Self, ConfigError> {
        let ok = reference_s > 0.0 && reference_s <= 1.0;
        in_range("reference_s", reference_s, ok, "(0, 1]")?;
        within("exponent", exponent, 0.05, 2.0, "[0.05, 2]")?;
        within("saturation_pa", saturation_pa, 1.0, 1e12, "[1, 1e12]")?;
        Ok(Self {
            reference_s,
            exponent,
            saturation_pa,
        })
    }

    /// Conductance under `pressure_pa` ≥ 0, S.
    #[inline]
    pub(crate) fn conductance_s(&self, pressure_pa: f64) -> f64 {
        let p = pressure_pa / (1.0 + pressure_pa / self.saturation_pa);
        self.reference_s * (p / REFERENCE_PA).powf(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The reference itself, the power law far below saturation (neglected: n·P/Ps = 5e-7) and the plateau far above it
    /// (n·Ps/P).
    #[test]
    fn the_law_has_its_limits() {
        let law = PressureLaw::new(1e-4, 0.5, 1e12).unwrap();
        assert_relative_eq!(law.conductance_s(REFERENCE_PA), 1e-4, max_relative = 1e-8);
        assert_relative_eq!(
            law.conductance_s(4e4) / law.conductance_s(1e4),
            2.0,
            max_relative = 1e-7
        );
        let law = PressureLaw::new(1e-4, 0.5, 4e4).unwrap();
        assert_relative_eq!(law.conductance_s(1e9), 2e-4, max_relative = 0.5 * 4e4 / 1e9);
        assert!(law.conductance_s(0.0) <= 0.0);
    }
}
