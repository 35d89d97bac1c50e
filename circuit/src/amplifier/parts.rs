//! The parts of the amplifier, and what is on its bus.

use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::within;

/// Smallest capacitance of a bus, F. A bus that is said to have none gets this much, and one set of equations serves
/// both cases. It is no more than a placeholder as long as ωt·Rf·1 aF ≪ 1, which is the square of the quality factor
/// with nothing on the bus: 7e-8 for 10 MHz and 1 kΩ, 0.07 for 1 GΩ. Beyond that, at 1 GΩ with a gain-bandwidth product
/// of GHz, an empty bus of 1 aF rings, and a bus of no capacitance at all is not modelled.
pub(super) const LEAST_CAPACITANCE_F: f64 = 1e-18;

/// An operational amplifier with one pole. The defaults are the TLV9362's on ± 15 V.
///
/// Source: Texas Instruments, data sheet SBOSAD6 (gain-bandwidth product, slew rate, noise, offset, output current);
/// open-loop gain, current noise and 1/f corner are usual values of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct OpAmp {
    /// Gain-bandwidth product GBW, Hz. Range [1, 1e12].
    pub gain_bandwidth_hz: f64,
    /// Open-loop gain A0 at DC. Range [10, 1e9].
    pub dc_gain: f64,
    /// Largest rate of change of the output, V/s. Range [1, 1e15].
    pub slew_v_per_s: f64,
    /// The output stays within ± this voltage, V. Range [1e-3, 1e6]. Default: 0.1 V inside ± 15 V; the part allows ± 20
    /// V.
    pub rail_v: f64,
    /// Largest output current, A. Range [1e-9, 1e6].
    pub output_a: f64,
    /// Input voltage noise en far above `noise_corner_hz`, V/√Hz. Range [0, 1e-3].
    pub noise_v_per_rthz: f64,
    /// Corner fc of the 1/f noise, Hz. The input voltage noise is en²·(1 + fc/f) above 1 Hz, and en² below, where 1/f
    /// noise counts as offset. 0 gives white noise only. Range [0, 1e9].
    pub noise_corner_hz: f64,
    /// Input current noise in, A/√Hz, white. Range [0, 1e-3].
    pub noise_a_per_rthz: f64,
}

impl Default for OpAmp {
    fn default() -> Self {
        Self {
            gain_bandwidth_hz: 10.6e6,
            dc_gain: 1e6,
            slew_v_per_s: 25e6,
            rail_v: 14.9,
            output_a: 60e-3,
            noise_v_per_rthz: 6e-9,
            noise_corner_hz: 1e3,
            noise_a_per_rthz: 1e-13,
        }
    }
}

/// The passive parts around the operational amplifier.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Feedback resistance Rf, Ω. Range [1e-9, 1e9]. Default 1 kΩ, an estimate: only Rf·Vd·G of the device is known.
    pub feedback_ohm: f64,
    /// Capacitance Cf across the feedback resistance, F. Range [0, 1e-6]. Default 0, as the device is not known to have
    /// one.
    pub feedback_f: f64,
    /// Capacitance Cb between bus and ground, including the amplifier's input, F. Range [0, 1], enough for a million
    /// taxels of 1 µF. Default 0, as the value is not known. A few nF, possible for 100 electrodes with their wires,
    /// make the output ring for several µs.
    pub bus_f: f64,
    /// Input offset Vos, V. Range [−1, 1]. Default 0; the TLV9362 has ± 0.4 mV.
    pub offset_v: f64,
    /// Temperature of all resistances, K. Range [1, 1000]. Default 300.
    pub temperature_k: f64,
}

impl Default for Network {
    fn default() -> Self {
        Self { feedback_ohm: 1e3, feedback_f: 0.0, bus_f: 0.0, offset_v: 0.0, temperature_k: 300.0 }
    }
}

/// A summing amplifier whose parameters are all within their ranges.
///
/// ```
/// use spts_circuit::amplifier::{Amplifier, Network, OpAmp};
///
/// let network = Network { bus_f: 2e-9, ..Network::default() };
/// assert!(Amplifier::new(OpAmp::default(), network).is_ok());
/// let error = Amplifier::new(OpAmp::default(), Network { bus_f: -1.0, ..network }).unwrap_err();
/// assert!(error.to_string().contains("bus_f"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplifier {
    op_amp: OpAmp,
    network: Network,
}

impl Amplifier {
    /// An amplifier of the operational amplifier `op_amp` with the feedback, bus and temperature in `network`.
    ///
    /// # Errors
    /// [`Refusal`] that names the parameter outside its range.
    pub fn new(op_amp: OpAmp, network: Network) -> Result<Self, Refusal> {
        within("gain_bandwidth_hz", op_amp.gain_bandwidth_hz, 1.0, 1e12, "[1, 1e12]")?;
        within("dc_gain", op_amp.dc_gain, 10.0, 1e9, "[10, 1e9]")?;
        within("slew_v_per_s", op_amp.slew_v_per_s, 1.0, 1e15, "[1, 1e15]")?;
        within("rail_v", op_amp.rail_v, 1e-3, 1e6, "[1e-3, 1e6]")?;
        within("output_a", op_amp.output_a, 1e-9, 1e6, "[1e-9, 1e6]")?;
        within("noise_v_per_rthz", op_amp.noise_v_per_rthz, 0.0, 1e-3, "[0, 1e-3]")?;
        within("noise_corner_hz", op_amp.noise_corner_hz, 0.0, 1e9, "[0, 1e9]")?;
        within("noise_a_per_rthz", op_amp.noise_a_per_rthz, 0.0, 1e-3, "[0, 1e-3]")?;
        within("feedback_ohm", network.feedback_ohm, 1e-9, 1e9, "[1e-9, 1e9]")?;
        within("feedback_f", network.feedback_f, 0.0, 1e-6, "[0, 1e-6]")?;
        within("bus_f", network.bus_f, 0.0, 1.0, "[0, 1]")?;
        within("offset_v", network.offset_v, -1.0, 1.0, "[−1, 1]")?;
        within("temperature_k", network.temperature_k, 1.0, 1e3, "[1, 1000]")?;
        Ok(Self { op_amp, network })
    }

    /// The operational amplifier.
    pub fn op_amp(&self) -> &OpAmp {
        &self.op_amp
    }

    /// The passive parts around it.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// ωt = 2π·GBW, rad/s.
    pub(super) fn unity_rad_per_s(&self) -> f64 {
        std::f64::consts::TAU * self.op_amp.gain_bandwidth_hz
    }

    /// ωp = ωt/A0, rad/s.
    pub(super) fn pole_rad_per_s(&self) -> f64 {
        self.unity_rad_per_s() / self.op_amp.dc_gain
    }

    /// Cb + Cf, F; never below [`LEAST_CAPACITANCE_F`].
    pub(super) fn capacitance_f(&self) -> f64 {
        (self.network.bus_f + self.network.feedback_f).max(LEAST_CAPACITANCE_F)
    }

    /// S + 1/Rf for ΣG = `conductance_s`, S.
    pub(super) fn bus_s(&self, conductance_s: f64) -> f64 {
        conductance_s + 1.0 / self.network.feedback_ohm
    }
}

/// What the taxels feed into the bus while their drives are constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BusLoad {
    /// S = ΣGk, S. Range [0, 1e9].
    pub conductance_s: f64,
    /// I = ΣGk·Vk, A. The output settles near −Rf·I, which must lie within ± 1e9 V.
    pub current_a: f64,
}

impl BusLoad {
    /// Finite, and no negative conductance.
    pub(super) fn check(self) {
        let Self { conductance_s, current_a } = self;
        debug_assert!(
            conductance_s.is_finite() && conductance_s >= 0.0 && current_a.is_finite(),
            "a load of {conductance_s} S and {current_a} A is not finite, or negative"
        );
    }
}

/// Bus and output at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct State {
    pub(super) sum_v: f64,
    pub(super) output_v: f64,
}
