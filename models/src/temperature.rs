//! Change of the conductance with temperature.

use crate::config::{ConfigError, within};

/// Temperature for which the law is given, °C.
pub const REFERENCE_C: f64 = 25.0;

/// Factor of the conductance at `temperature_c`, when the resistance has the temperature coefficient α =
/// `resistance_per_k`:
///
/// G(T)/G(25 °C) = exp(−α·(T − 25 °C)).
///
/// It solves dR/dT = α·R; the linear form R = R₂₅·(1 + α·ΔT) is its first order. Carbon black in polyethylene has a
/// positive coefficient (PTC): the matrix expands and parts the chains of particles. Exactly 1 at 25 °C. A sheet near
/// the melting point of its matrix (> 100 °C, a PTC switch) is not described.
///
/// # Errors
/// [`ConfigError`] for a temperature outside [-45, 65] °C, the range of use of the sheet, or a coefficient outside
/// [-0.02, 0.02] 1/K.
pub(crate) fn conductance_factor(temperature_c: f64, resistance_per_k: f64) -> Result<f64, ConfigError> {
    within("temperature_c", temperature_c, -45.0, 65.0, "[-45, 65]")?;
    within("resistance_per_k", resistance_per_k, -0.02, 0.02, "[-0.02, 0.02]")?;
    Ok((-resistance_per_k * (temperature_c - REFERENCE_C)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// First order in α·ΔT = 0.04: what is left is half its square.
    #[test]
    fn warmth_raises_the_resistance() {
        assert_relative_eq!(conductance_factor(25.0, 0.02).unwrap(), 1.0, epsilon = 0.0);
        let factor = conductance_factor(35.0, 0.004).unwrap();
        assert_relative_eq!(factor, 1.0 / 1.04, max_relative = 0.5 * 0.04 * 0.04);
        assert!(conductance_factor(35.0, -0.004).unwrap() > 1.0);
        assert!(conductance_factor(f64::NAN, 0.004).is_err());
    }
}
