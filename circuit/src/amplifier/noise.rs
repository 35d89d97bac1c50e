//! Noise at the amplifier's output, by source.

use super::parts::Amplifier;
use super::response::AmplifierResponse;
use serde::Serialize;
use std::f64::consts::TAU;

/// Boltzmann's constant, J/K; exact in the SI of 2019.
const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;
/// 1/f noise begins here, Hz: what is slower counts as offset.
const FLICKER_FROM_HZ: f64 = 1.0;

/// Noise by source: at the output in V, or as a density in V/√Hz.
///
/// ```
/// use spts_circuit::amplifier::{Amplifier, Network, AmplifierNoise, OpAmp};
///
/// let amplifier = Amplifier::new(OpAmp::default(), Network::default())?;
/// let noise = AmplifierNoise::rms(&amplifier, 0.01);
/// assert!(noise.voltage > noise.feedback, "the operational amplifier's voltage noise is amplified by 1 + Rf·ΣG");
/// assert!(noise.total() < 1e-3, "less than 1 mV, far below the converter's step");
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AmplifierNoise {
    /// Thermal noise of the taxels: a current of 4kT·ΣG into the bus.
    pub taxels: f64,
    /// Thermal noise of the feedback resistance: a current of 4kT/Rf into the bus.
    pub feedback: f64,
    /// Voltage noise of the operational amplifier at its inputs, 1/f noise included.
    pub voltage: f64,
    /// Current noise of the operational amplifier into the bus.
    pub current: f64,
}

impl AmplifierNoise {
    /// Noise density at the output at `frequency_hz` ≥ 0, V/√Hz, with the conductance `conductance_s` = ΣG of all
    /// taxels on the bus, S.
    #[must_use]
    pub fn density(amplifier: &Amplifier, conductance_s: f64, frequency_hz: f64) -> Self {
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let per_current = response.gain_ohm(frequency_hz);
        let per_voltage = per_current * response.bus_s.hypot(TAU * frequency_hz * response.a[2]);
        let corner_hz = amplifier.op_amp().noise_corner_hz;
        let flicker = if frequency_hz >= FLICKER_FROM_HZ {
            corner_hz / frequency_hz
        } else {
            0.0
        };
        Self::scaled(
            amplifier,
            conductance_s,
            per_current,
            per_voltage * (1.0 + flicker).sqrt(),
        )
    }

    /// Root mean square of the noise at the output over all frequencies, V, with the conductance `conductance_s` = S =
    /// ΣG of all taxels on the bus. H is the transfer function from a current, and E = H·(S + 1/Rf + s C) that from the
    /// input voltage, to the output:
    ///
    /// ∫|H|² df = ωt²/(4 a₀ a₁), ∫|E|² df = ωt² ((S + 1/Rf)² + C a₀)/(4 a₀ a₁), C = Cb + Cf.
    ///
    /// 1/f noise adds fc ∫|E|²/f df from 1 Hz on, see `AmplifierResponse::flicker`.
    ///
    /// Source: the integral of |(b₁s + b₀)/(a₂s² + a₁s + a₀)|² over all frequencies, (b₁²a₀ + b₀²a₂)/(2a₀a₁a₂); H. M.
    /// James, N. B. Nichols, R. S. Phillips, *Theory of Servomechanisms* (1947), appendix.
    #[must_use]
    pub fn rms(amplifier: &Amplifier, conductance_s: f64) -> Self {
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let [a0, a1, a2] = response.a;
        let per_current = response.unity / (4.0 * a0 * a1).sqrt();
        let per_voltage = per_current * response.bus_s.hypot((a2 * a0).sqrt());
        let corner_hz = amplifier.op_amp().noise_corner_hz;
        let flicker = if corner_hz > 0.0 {
            (corner_hz * response.flicker(FLICKER_FROM_HZ)).sqrt()
        } else {
            0.0
        };
        Self::scaled(amplifier, conductance_s, per_current, per_voltage.hypot(flicker))
    }

    /// Root sum of squares, because the sources are independent.
    #[must_use]
    pub fn total(&self) -> f64 {
        let Self {
            taxels,
            feedback,
            voltage,
            current,
        } = self;
        taxels.hypot(*feedback).hypot(*voltage).hypot(*current)
    }

    fn scaled(amplifier: &Amplifier, conductance_s: f64, per_current: f64, per_voltage: f64) -> Self {
        let (op_amp, network) = (amplifier.op_amp(), amplifier.network());
        let thermal = |conductance_s: f64| (4.0 * BOLTZMANN_J_PER_K * network.temperature_k * conductance_s).sqrt();
        Self {
            taxels: per_current * thermal(conductance_s),
            feedback: per_current * thermal(1.0 / network.feedback_ohm),
            voltage: per_voltage * op_amp.noise_v_per_rthz,
            current: per_current * op_amp.noise_a_per_rthz,
        }
    }
}
