//! The amplifier's response to small signals in closed form, and the noise at its output by source.

use super::motion::{Decay, crossing};
use super::parts::Amplifier;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Small-signal response with ΣG = S on the bus. The transfer function from a current into the bus to the output is
///
/// H(s) = −ωt / (a₂ s² + a₁ s + a₀), a₂ = Cb + Cf, a₁ = S + 1/Rf + ωp (Cb + Cf) + ωt Cf, a₀ = ωp (S + 1/Rf) + ωt/Rf.
///
/// Source: nodal analysis of the circuit in [the module](super). Without capacitances the result is the textbook single
/// pole, GBW/(1 + Rf·S).
///
/// ```
/// use spts_circuit::amplifier::{Amplifier, Network, OpAmp, AmplifierResponse};
///
/// let amplifier = Amplifier::new(OpAmp::default(), Network::default())?;
/// let small = AmplifierResponse::new(&amplifier, 100.0 * 1e-4); // 100 taxels of 0.1 mS
/// let large = AmplifierResponse::new(&amplifier, 10_000.0 * 1e-4);
/// assert!((small.noise_gain() - 11.0).abs() < 1e-9);
/// assert!(large.bandwidth_hz() < small.bandwidth_hz() / 50.0, "more taxels, less bandwidth");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplifierResponse {
    noise_gain: f64,
    /// ωt, rad/s.
    pub(super) unity: f64,
    /// S + 1/Rf, S.
    pub(super) bus_s: f64,
    /// a₀, a₁, a₂.
    pub(super) a: [f64; 3],
}

impl AmplifierResponse {
    /// Response of `amplifier` with ΣG = `conductance_s` ≥ 0, S.
    pub fn new(amplifier: &Amplifier, conductance_s: f64) -> Self {
        let (unity, pole) = (amplifier.unity_rad_per_s(), amplifier.pole_rad_per_s());
        let network = amplifier.network();
        let (bus_s, capacitance_f) = (amplifier.bus_s(conductance_s), amplifier.capacitance_f());
        Self {
            noise_gain: 1.0 + network.feedback_ohm * conductance_s,
            unity,
            bus_s,
            a: [
                pole * bus_s + unity / network.feedback_ohm,
                bus_s + pole * capacitance_f + unity * network.feedback_f,
                capacitance_f,
            ],
        }
    }

    /// Noise gain 1 + Rf·ΣG, by which noise and offset at the inputs are amplified.
    pub fn noise_gain(&self) -> f64 {
        self.noise_gain
    }

    /// |H| at `frequency_hz` ≥ 0, output over current into the bus, V/A; close to Rf at DC.
    pub(crate) fn gain_ohm(&self, frequency_hz: f64) -> f64 {
        let ([a0, a1, a2], omega) = (self.a, TAU * frequency_hz);
        self.unity / (a0 - a2 * omega * omega).hypot(a1 * omega)
    }

    /// Quality factor Q = √(a₀ a₂)/a₁. The output rings when it is above ½.
    pub fn quality(&self) -> f64 {
        (self.a[0] * self.a[2]).sqrt() / self.a[1]
    }

    /// Frequency of the ringing after a step, Hz: f₀ √(1 − 1/4Q²); `None` without ringing.
    pub fn ringing_hz(&self) -> Option<f64> {
        self.decay().turning().map(|rad_per_s| rad_per_s / TAU)
    }

    /// Rate a₁/2a₂ at which the ringing decays, 1/s.
    pub fn damping_per_s(&self) -> f64 {
        -self.decay().sigma()
    }

    /// Frequency f at which the response is down by 3 dB, Hz: it solves |a₀ − a₂ω² + i a₁ω|² = 2a₀² for ω = 2πf.
    pub fn bandwidth_hz(&self) -> f64 {
        let [a0, a1, a2] = self.a;
        // a₂² u² + p u = a₀² with u = ω²
        let p = a1 * a1 - 2.0 * a0 * a2;
        let root = p.hypot(2.0 * a0 * a2);
        let u = if p >= 0.0 { 2.0 * a0 * a0 / (p + root) } else { (root - p) / (2.0 * a2 * a2) };
        u.sqrt() / TAU
    }

    /// Time after a step of the drives from which the output stays within `fraction` of the step, s, if it does not
    /// slew. Half a step of a converter of b bits is the fraction 2^−(b+1) of its range.
    pub fn settle_s(&self, fraction: f64) -> f64 {
        settle_s(&self.decay(), fraction)
    }

    /// ∫|E|²/f df from `from_hz` > 0 on, with E = H·(S + 1/Rf + s C) from the input voltage to the output. With u = ω²,
    /// D(u) = a₂² u² + p u + a₀², p = a₁² − 2 a₀ a₂, B = S + 1/Rf and C = a₂ it is, by partial fractions,
    ///
    /// ½ ωt² ∫ (B² + C² u)/(u D) du = ½ ωt² ((B/a₀)² (½ ln(D/(a₂ u)²) − ½ p J) + C² J), J = ∫ du/D,
    ///
    /// from u = (2π·`from_hz`)² to infinity. For √Δ, Δ = p² − 4 a₀² a₂²: J = ln((x + √Δ)/(x − √Δ))/√Δ with x = 2 a₂² u
    /// + p, which is 2 arg(x + i √−Δ)/√−Δ where it rings.
    pub(super) fn flicker(&self, from_hz: f64) -> f64 {
        let [a0, a1, a2] = self.a;
        let u = (TAU * from_hz).powi(2);
        let p = a1 * a1 - 2.0 * a0 * a2;
        let delta = a1 * a1 * (a1 * a1 - 4.0 * a0 * a2);
        let (root, square) = (delta.abs().sqrt(), a2 * a2);
        let j = if delta < 0.0 {
            2.0 * root.atan2(2.0 * square * u + p) / root
        } else {
            // x − √Δ, without losing digits; p > 0 here
            let least = 2.0 * square * (u + 2.0 * a0 * a0 / (p + root));
            if root > 0.0 { (2.0 * root / least).ln_1p() / root } else { 2.0 / least }
        };
        let d = square * u * u + p * u + a0 * a0;
        let low = 0.5 * (d.ln() - 2.0 * (a2 * u).ln()) - 0.5 * p * j;
        // below the rounding of the logarithms when all of the response lies under `from_hz`
        (0.5 * self.unity * self.unity * ((self.bus_s / a0).powi(2) * low + square * j)).max(0.0)
    }

    fn decay(&self) -> Decay {
        let [a0, a1, a2] = self.a;
        let sigma = -0.5 * a1 / a2;
        Decay::new(sigma, a0 / a2, sigma * sigma - a0 / a2)
    }
}

/// Time from which on the error of the step response stays within `fraction` in (0, 1): the last solution of |e(t)| =
/// fraction for e″ − 2σe′ + (σ² − δ)e = 0, e(0) = 1, e′(0) = 0.
///
/// Where it rings, the error has its extrema at kπ/ω with the sizes e^(σkπ/ω), and the time follows the last extremum
/// that is too large; where it does not, the error falls steadily.
pub(super) fn settle_s(decay: &Decay, fraction: f64) -> f64 {
    let error = |t: f64| decay.value(1.0, 0.0, t);
    // not a shrinking fraction, or one that has no logarithm
    let time_constants = (1.0 / fraction.clamp(f64::MIN_POSITIVE, 1.0)).ln();
    if let Some(turning) = decay.turning() {
        let half_turn_s = PI / turning;
        let last = (time_constants / (-decay.sigma() * half_turn_s)).floor();
        let sign = error(last * half_turn_s).signum();
        return crossing(&|t| sign * error(t) - fraction, last * half_turn_s, (last + 1.0) * half_turn_s);
    }
    // e(t) ≤ (1 + |slow| t) e^(−|slow| t), which is below e^(−x) from |slow| t = 2x + 2 on
    let longest_s = (2.0 * time_constants + 2.0) / decay.slowest_per_s();
    crossing(&|t| error(t) - fraction, 0.0, longest_s)
}

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
/// # Ok::<(), spts_input::Refusal>(())
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
    pub fn density(amplifier: &Amplifier, conductance_s: f64, frequency_hz: f64) -> Self {
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let per_current = response.gain_ohm(frequency_hz);
        let per_voltage = per_current * response.bus_s.hypot(TAU * frequency_hz * response.a[2]);
        let corner_hz = amplifier.op_amp().noise_corner_hz;
        let flicker = if frequency_hz >= FLICKER_FROM_HZ { corner_hz / frequency_hz } else { 0.0 };
        Self::scaled(amplifier, conductance_s, per_current, per_voltage * (1.0 + flicker).sqrt())
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
    pub fn rms(amplifier: &Amplifier, conductance_s: f64) -> Self {
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let [a0, a1, a2] = response.a;
        let per_current = response.unity / (4.0 * a0 * a1).sqrt();
        let per_voltage = per_current * response.bus_s.hypot((a2 * a0).sqrt());
        let corner_hz = amplifier.op_amp().noise_corner_hz;
        let flicker = if corner_hz > 0.0 { (corner_hz * response.flicker(FLICKER_FROM_HZ)).sqrt() } else { 0.0 };
        Self::scaled(amplifier, conductance_s, per_current, per_voltage.hypot(flicker))
    }

    /// Root sum of squares, because the sources are independent.
    pub fn total(&self) -> f64 {
        let Self { taxels, feedback, voltage, current } = self;
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
