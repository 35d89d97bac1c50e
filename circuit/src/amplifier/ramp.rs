//! The amplifier while its output slews or is at a rail: the output is a straight line, the bus a first-order system.

use super::parts::Amplifier;
use super::root::crossing;
use super::state::{BusLoad, State};

/// Output at the constant rate r; the bus follows v′ = −k v + b + c t, k = (S + 1/Rf)/C.
pub(super) struct Ramp<'a> {
    amplifier: &'a Amplifier,
    start: State,
    /// r, V/s: ± the slew rate, or 0 at a rail.
    rate: f64,
    /// +1 or −1: direction in which the output is driven.
    sign: f64,
    /// k, 1/s.
    decay_per_s: f64,
    /// v′ at the start, V/s.
    slope: f64,
    /// c, V/s².
    forcing: f64,
}

impl<'a> Ramp<'a> {
    /// Phase from `start` on: driven up or down, with the output at `rate`.
    pub(super) fn new(amplifier: &'a Amplifier, load: BusLoad, start: State, rate: f64, up: bool) -> Self {
        let network = amplifier.network();
        let (bus_s, capacitance_f) = (amplifier.bus_s(load.conductance_s), amplifier.capacitance_f());
        let current_a =
            network.feedback_f * rate - bus_s * start.sum_v + start.output_v / network.feedback_ohm + load.current_a;
        Self {
            amplifier,
            start,
            rate,
            sign: if up { 1.0 } else { -1.0 },
            decay_per_s: bus_s / capacitance_f,
            slope: current_a / capacitance_f,
            forcing: rate / (network.feedback_ohm * capacitance_f),
        }
    }

    /// State after `t` seconds: v = v₀ + v₀′ φ₁ + c φ₂ with φ₁ = (1 − e^(−kt))/k and φ₂ = (t − φ₁)/k.
    pub(super) fn after(&self, t: f64) -> State {
        let x = self.decay_per_s * t;
        let lost = -(-x).exp_m1();
        let first = lost / self.decay_per_s;
        // (x − (1 − e^(−x)))/x², where the difference would lose digits by its series: the term left out is x⁴/360 of
        // the first
        let second = if x < 1e-3 {
            t * t * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)))
        } else {
            (t - first) / self.decay_per_s
        };
        State {
            sum_v: self.start.sum_v + self.slope * first + self.forcing * second,
            output_v: self.start.output_v + self.rate * t,
        }
    }

    /// First time within `dt_s` at which the output is no longer driven at more than `least_v_per_s` in the phase's
    /// direction.
    ///
    /// The demand is a straight line and an exponential: it has one extremum at most, and is monotone on either side of
    /// it.
    pub(super) fn release(&self, dt_s: f64, least_v_per_s: f64) -> Option<f64> {
        let excess = |t: f64| self.sign * demand_v_per_s(self.amplifier, self.after(t)) - least_v_per_s;
        let mut from = 0.0;
        for to in [self.extremum().min(dt_s), dt_s] {
            if to <= from {
                continue;
            }
            if excess(to) < 0.0 {
                let inside = excess(from) > 0.0;
                return Some(if inside { crossing(&excess, from, to) } else { from });
            }
            from = to;
        }
        None
    }

    /// Time at which v′ = −r/A0, where the demand has its extremum; infinite where it has none after the start.
    fn extremum(&self) -> f64 {
        let drift = self.rate / self.amplifier.op_amp().dc_gain;
        let steady = self.forcing / self.decay_per_s;
        let t = (-(self.slope + drift) / (steady + drift)).ln_1p() / self.decay_per_s;
        if t > 0.0 { t } else { f64::INFINITY }
    }
}

/// Rate that the operational amplifier asks of its output: ωt (Vos − v) − ωp o, V/s.
pub(super) fn demand_v_per_s(amplifier: &Amplifier, state: State) -> f64 {
    amplifier.unity_rad_per_s() * (amplifier.network().offset_v - state.sum_v)
        - amplifier.pole_rad_per_s() * state.output_v
}
