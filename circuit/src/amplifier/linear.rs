//! The amplifier between slewing and rails: a linear second-order system.

use super::decay::Decay;
use super::parts::Amplifier;
use super::root::crossing;
use super::state::{BusLoad, State};

/// Share by which the slew rate or a rail has to be exceeded before it acts: rounding alone must not switch phases.
const MARGIN: f64 = 1e-9;
/// The same in shares of the numbers that cancel in rate and output: some dozens of roundings.
const ROUNDING: f64 = 1e-14;

/// What ends a linear phase early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
    /// The output exceeds the slew rate; `true` if upwards.
    Slew(bool),
    /// The output reaches a rail; `true` for the upper one.
    Rail(bool),
}

/// x′ = M (x − x∞) with x = (v, o), and its closed-form solution
///
/// x(t) = x∞ + e^(σt) [cosh(√δ t) + sinh(√δ t)/√δ · (M − σ)] (x₀ − x∞), σ = tr M / 2, δ = σ² − det M.
///
/// Source: the exponential of a 2 × 2 matrix by the theorem of Cayley and Hamilton.
pub(super) struct Linear {
    decay: Decay,
    m: [[f64; 2]; 2],
    rest: State,
}

impl Linear {
    pub(super) fn new(amplifier: &Amplifier, load: BusLoad) -> Self {
        let (unity, pole) = (amplifier.unity_rad_per_s(), amplifier.pole_rad_per_s());
        let (feedback_ohm, feedback_f) = (amplifier.network().feedback_ohm, amplifier.network().feedback_f);
        let (bus_s, capacitance_f) = (amplifier.bus_s(load.conductance_s), amplifier.capacitance_f());
        let m = [
            [
                -(feedback_f * unity + bus_s) / capacitance_f,
                (1.0 / feedback_ohm - feedback_f * pole) / capacitance_f,
            ],
            [-unity, -pole],
        ];
        let product = (pole * bus_s + unity / feedback_ohm) / capacitance_f;
        let delta = (0.5 * (m[0][0] - m[1][1])).powi(2) + m[0][1] * m[1][0];
        Self {
            decay: Decay::new(0.5 * (m[0][0] + m[1][1]), product, delta),
            m,
            rest: rest(amplifier, load),
        }
    }

    /// State after `t` seconds in this phase.
    pub(super) fn after(&self, state: State, t: f64) -> State {
        let (v, o) = (state.sum_v - self.rest.sum_v, state.output_v - self.rest.output_v);
        let (c, s) = self.decay.at(t);
        let [[vv, vo], [ov, oo]] = self.m;
        let sigma = self.decay.sigma();
        State {
            sum_v: self.rest.sum_v + c * v + s * ((vv - sigma) * v + vo * o),
            output_v: self.rest.output_v + c * o + s * (ov * v + (oo - sigma) * o),
        }
    }

    /// First time within `dt_s` at which the output changes faster than `slew_v_per_s` or leaves ± `rail_v`.
    ///
    /// Output and rate both are free motions of the same two modes. Between its extrema, which are known in closed
    /// form, each is monotone; and because they decay, none goes beyond its first two extrema and its end. So it is
    /// enough to look at those, and to search where a limit is passed between one and the next.
    pub(super) fn exit(&self, state: State, dt_s: f64, slew_v_per_s: f64, rail_v: f64) -> Option<(f64, Exit)> {
        let d = [state.sum_v - self.rest.sum_v, state.output_v - self.rest.output_v];
        let first = self.derivative(d);
        let second = self.derivative(first);
        let third = self.derivative(second);
        let rate = |t: f64| self.decay.value(first[1], second[1], t);
        let output = |t: f64| self.rest.output_v + self.decay.value(d[1], first[1], t);
        let [a, b] = self.decay.zeros(first[1], second[1]);
        let [c, e] = self.decay.zeros(second[1], third[1]);
        // an extremum that its cancelling modes hide from `zeros` is where the fast one has died away
        let mut nodes = [a, b, c, e, self.decay.fast_gone_s(), dt_s].map(|t| t.min(dt_s));
        nodes.sort_unstable_by(f64::total_cmp);
        let [ov, oo] = self.m[1];
        let slew_limit = slew_v_per_s * (1.0 + MARGIN) + ROUNDING * (ov * d[0]).abs().max((oo * d[1]).abs());
        let rail_limit = rail_v * (1.0 + MARGIN) + ROUNDING * self.rest.output_v.abs().max(d[1].abs());
        let mut from = 0.0;
        for to in nodes {
            if to <= from {
                continue;
            }
            let (fast, far) = (rate(to), output(to));
            let slews = (fast.abs() > slew_limit).then(|| {
                let t = crossing(&|t| fast.signum() * rate(t) - slew_v_per_s, from, to);
                (t, Exit::Slew(fast > 0.0))
            });
            let hits = (far.abs() > rail_limit).then(|| {
                let t = crossing(&|t| far.signum() * output(t) - rail_v, from, to);
                (t, Exit::Rail(far > 0.0))
            });
            let earlier = match (slews, hits) {
                (Some(s), Some(h)) => Some(if s.0 < h.0 { s } else { h }),
                (s, h) => s.or(h),
            };
            if earlier.is_some() {
                return earlier;
            }
            from = to;
        }
        None
    }

    fn derivative(&self, x: [f64; 2]) -> [f64; 2] {
        self.m.map(|row| row[0] * x[0] + row[1] * x[1])
    }
}

/// Where the linear system comes to rest, rails or not:
///
/// o∞ = ((1 + Rf·S)·Vos − Rf·I) / (1 + (1 + Rf·S)/A0), v∞ = Vos − o∞/A0.
pub(super) fn rest(amplifier: &Amplifier, load: BusLoad) -> State {
    let (network, dc_gain) = (amplifier.network(), amplifier.op_amp().dc_gain);
    let noise_gain = network.feedback_ohm * amplifier.bus_s(load.conductance_s);
    let output_v =
        (noise_gain * network.offset_v - network.feedback_ohm * load.current_a) / (1.0 + noise_gain / dc_gain);
    State {
        sum_v: network.offset_v - output_v / dc_gain,
        output_v,
    }
}
