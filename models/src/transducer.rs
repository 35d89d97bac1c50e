//! The seam between contact and circuit.

use crate::grid::{ConductanceMap, PressureMap};

/// Turns the pressure on the taxels' electrodes into their conductance.
pub trait Transducer: Send {
    /// Advances the state by `dt_s` seconds under `pressure` and writes the conductance at the end of the step.
    ///
    /// `pressure` and `out` have the shape of the skin. `dt_s` may be zero: `out` is then the instantaneous conductance.
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap);
}
