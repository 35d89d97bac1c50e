//! Bus and output as functions of time, for time steps from zero to hours.

use super::motion::{Decay, crossing};
use super::parts::{Amplifier, BusLoad, Network, OpAmp, State};
use spts_models::Snapshot;

/// What the output does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Linear,
    /// At the slew rate; `true` if upwards.
    Slew(bool),
    /// At a rail; `true` for the upper one.
    Rail(bool),
}

/// Phases of one step after which the rest of it is taken as linear between the rails. A ringing amplifier changes
/// phase four times a turn, and loses a share of 1/Q of its swing in one, so that Q would have to be in the tens of
/// thousands.
const PHASES: u32 = 100_000;

/// The amplifier in the time domain. Between changes of the load the solution is exact for any step: a second-order
/// linear system, straight lines while the output slews or is at a rail, and switching times found to rounding
/// accuracy. Rounding is relative to the present voltage or to the final voltage without rails, whichever is larger. A
/// rail limits the output itself, not a copy of it, so the amplifier leaves the rail as soon as its input allows.
///
/// ```
/// use spts_circuit::amplifier::{Amplifier, BusLoad, Network, OpAmp, Transient};
///
/// let amplifier = Amplifier::new(OpAmp::default(), Network::default())?;
/// let mut transient = Transient::new(amplifier);
/// let load = BusLoad { conductance_s: 0.01, current_a: -2e-3 };
/// transient.advance(load, 15e-6); // one measurement
/// assert!((transient.output_v() - 2.0).abs() < 0.01, "settled at −Rf·I");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Transient {
    amplifier: Amplifier,
    state: State,
}

impl Transient {
    /// An amplifier at rest with nothing on its bus.
    pub fn new(amplifier: Amplifier) -> Self {
        let mut transient = Self { amplifier, state: State::default() };
        transient.settle(BusLoad { conductance_s: 0.0, current_a: 0.0 });
        transient
    }

    /// Voltage of the bus, V.
    pub fn sum_v(&self) -> f64 {
        self.state.sum_v
    }

    /// Output, V.
    pub fn output_v(&self) -> f64 {
        self.state.output_v
    }

    /// Saves or loads the state.
    pub(crate) fn exchange(&mut self, state: &mut Snapshot) {
        state.f64s([&mut self.state.sum_v, &mut self.state.output_v]);
    }

    /// Sets the state that the amplifier finally reaches under `load`.
    ///
    /// # Panics
    /// In builds with debug assertions, if `load` is not finite or has a negative conductance. Other builds do not
    /// check; after a load that is not finite, bus and output are meaningless until the next call of this function.
    pub fn settle(&mut self, load: BusLoad) {
        load.check();
        self.state = rest(&self.amplifier, load);
        let rail_v = self.amplifier.op_amp().rail_v;
        if self.state.output_v.abs() > rail_v {
            let output_v = self.state.output_v.clamp(-rail_v, rail_v);
            let current_a = output_v / self.amplifier.network().feedback_ohm + load.current_a;
            self.state = State { sum_v: current_a / self.amplifier.bus_s(load.conductance_s), output_v };
        }
    }

    /// Advances time by `dt_s` (finite and ≥ 0) with `load` on the bus.
    ///
    /// # Panics
    /// In builds with debug assertions, for a load as in [`settle`](Self::settle) or such a time. Other builds do not
    /// check; bus and output are then meaningless until the next [`settle`](Self::settle).
    pub fn advance(&mut self, load: BusLoad, dt_s: f64) {
        load.check();
        debug_assert!(dt_s.is_finite() && dt_s >= 0.0, "dt_s = {dt_s} is outside [0, ∞)");
        let linear = Linear::new(&self.amplifier, load);
        let mut phase = self.phase();
        let mut left_s = dt_s;
        for _ in 0..PHASES {
            let (spent_s, next) = match phase {
                Phase::Linear => self.linear(&linear, left_s),
                Phase::Slew(up) => self.slew(load, up, left_s),
                Phase::Rail(up) => self.rail(load, up, left_s),
            };
            left_s -= spent_s;
            if left_s <= 0.0 {
                return;
            }
            phase = next;
        }
        let (OpAmp { rail_v, slew_v_per_s, .. }, before_v) = (*self.amplifier.op_amp(), self.state.output_v);
        let most_v = slew_v_per_s * left_s;
        self.state = linear.after(self.state, left_s);
        self.state.output_v = (self.state.output_v.clamp(before_v - most_v, before_v + most_v)).clamp(-rail_v, rail_v);
    }

    /// Phase in which a step begins.
    fn phase(&self) -> Phase {
        let op_amp = self.amplifier.op_amp();
        let (demand, output_v) = (demand_v_per_s(&self.amplifier, self.state), self.state.output_v);
        let up = demand > 0.0;
        if output_v.abs() >= op_amp.rail_v && up == (output_v > 0.0) {
            Phase::Rail(up)
        } else if demand.abs() > op_amp.slew_v_per_s {
            Phase::Slew(up)
        } else {
            Phase::Linear
        }
    }

    /// Linear phase of `left_s` at most: the time it took, and what follows.
    fn linear(&mut self, linear: &Linear, left_s: f64) -> (f64, Phase) {
        let op_amp = *self.amplifier.op_amp();
        let exit = linear.exit(self.state, left_s, op_amp.slew_v_per_s, op_amp.rail_v);
        self.state = linear.after(self.state, exit.map_or(left_s, |(t, _)| t));
        // what the margin of the exit let pass
        self.state.output_v = self.state.output_v.clamp(-op_amp.rail_v, op_amp.rail_v);
        match exit {
            None => (left_s, Phase::Linear),
            Some((t, Exit::Slew(up))) => (t, Phase::Slew(up)),
            Some((t, Exit::Rail(up))) => {
                self.state.output_v = op_amp.rail_v.copysign(if up { 1.0 } else { -1.0 });
                (t, Phase::Rail(up))
            }
        }
    }

    fn slew(&mut self, load: BusLoad, up: bool, left_s: f64) -> (f64, Phase) {
        let op_amp = *self.amplifier.op_amp();
        let sign = if up { 1.0 } else { -1.0 };
        let rail_s = ((op_amp.rail_v - sign * self.state.output_v) / op_amp.slew_v_per_s).max(0.0);
        let ramp = Ramp::new(&self.amplifier, load, self.state, sign * op_amp.slew_v_per_s, up);
        let longest_s = rail_s.min(left_s);
        match ramp.release(longest_s, op_amp.slew_v_per_s) {
            Some(t) => {
                self.state = ramp.after(t);
                (t, Phase::Linear)
            }
            None => {
                self.state = ramp.after(longest_s);
                if rail_s <= left_s {
                    self.state.output_v = sign * op_amp.rail_v;
                }
                (longest_s, Phase::Rail(up))
            }
        }
    }

    fn rail(&mut self, load: BusLoad, up: bool, left_s: f64) -> (f64, Phase) {
        let ramp = Ramp::new(&self.amplifier, load, self.state, 0.0, up);
        let t = ramp.release(left_s, 0.0).unwrap_or(left_s);
        self.state = ramp.after(t);
        (t, Phase::Linear)
    }
}

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
    /// Rates at 0 V: v′ and o′ are `m` (v, o) plus these.
    still: [f64; 2],
    rest: State,
}

impl Linear {
    pub(super) fn new(amplifier: &Amplifier, load: BusLoad) -> Self {
        let (unity, pole) = (amplifier.unity_rad_per_s(), amplifier.pole_rad_per_s());
        let Network { feedback_ohm, feedback_f, offset_v, .. } = *amplifier.network();
        let (bus_s, capacitance_f) = (amplifier.bus_s(load.conductance_s), amplifier.capacitance_f());
        let m = [
            [-(feedback_f * unity + bus_s) / capacitance_f, (1.0 / feedback_ohm - feedback_f * pole) / capacitance_f],
            [-unity, -pole],
        ];
        let product = (pole * bus_s + unity / feedback_ohm) / capacitance_f;
        let delta = (0.5 * (m[0][0] - m[1][1])).powi(2) + m[0][1] * m[1][0];
        Self {
            decay: Decay::new(0.5 * (m[0][0] + m[1][1]), product, delta),
            still: [(feedback_f * unity * offset_v + load.current_a) / capacitance_f, unity * offset_v],
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
        let (first, lost_v_per_s) = self.rates(state, d, slew_v_per_s);
        let second = self.derivative(first);
        let third = self.derivative(second);
        let rate = |t: f64| self.decay.value(first[1], second[1], t);
        let output = |t: f64| self.rest.output_v + self.decay.value(d[1], first[1], t);
        let [a, b] = self.decay.zeros(first[1], second[1]);
        let [c, e] = self.decay.zeros(second[1], third[1]);
        // an extremum that its cancelling modes hide from `zeros` is where the fast one has died away
        let mut nodes = [a, b, c, e, self.decay.fast_gone_s(), dt_s].map(|t| t.min(dt_s));
        nodes.sort_unstable_by(f64::total_cmp);
        let slew_limit = slew_v_per_s * (1.0 + MARGIN) + lost_v_per_s;
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

    /// Rates at `state`, which is `d` from rest, and what rounding may take from the output's. Where the rest is so far
    /// away that the slew rate is lost in it, the rates are those of the amplifier's equations themselves.
    fn rates(&self, state: State, d: [f64; 2], slew_v_per_s: f64) -> ([f64; 2], f64) {
        let terms = |[v, o]: [f64; 2]| self.m.map(|[from_v, from_o]| (from_v * v).abs().max((from_o * o).abs()));
        let lost = ROUNDING * terms(d)[1];
        if lost <= MARGIN * slew_v_per_s {
            return (self.derivative(d), lost);
        }
        let own = [state.sum_v, state.output_v];
        let [bus, output] = terms(own);
        // what the bus's rate has lost adds to the output's until the faster mode has died away
        let of_bus = bus.max(self.still[0].abs()) * self.m[1][0].abs() / self.decay.fastest_per_s();
        let own_lost = ROUNDING * (output.max(self.still[1].abs()) + of_bus);
        if own_lost >= lost {
            return (self.derivative(d), lost);
        }
        let [v, o] = self.derivative(own);
        ([v + self.still[0], o + self.still[1]], own_lost)
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
    State { sum_v: network.offset_v - output_v / dc_gain, output_v }
}

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
