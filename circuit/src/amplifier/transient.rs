//! Bus and output as functions of time, for time steps from zero to hours.

use super::linear::{Exit, Linear, rest};
use super::parts::Amplifier;
use super::ramp::{Ramp, demand_v_per_s};
use super::state::{BusLoad, State};

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
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Transient {
    amplifier: Amplifier,
    state: State,
}

impl Transient {
    /// An amplifier at rest with nothing on its bus.
    #[must_use]
    pub fn new(amplifier: Amplifier) -> Self {
        let mut transient = Self {
            amplifier,
            state: State::default(),
        };
        transient.settle(BusLoad {
            conductance_s: 0.0,
            current_a: 0.0,
        });
        transient
    }

    /// Voltage of the bus, V.
    #[must_use]
    pub fn sum_v(&self) -> f64 {
        self.state.sum_v
    }

    /// Output, V.
    #[must_use]
    pub fn output_v(&self) -> f64 {
        self.state.output_v
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
            self.state = State {
                sum_v: current_a / self.amplifier.bus_s(load.conductance_s),
                output_v,
            };
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
        let rail_v = self.amplifier.op_amp().rail_v;
        self.state = linear.after(self.state, left_s);
        self.state.output_v = self.state.output_v.clamp(-rail_v, rail_v);
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
