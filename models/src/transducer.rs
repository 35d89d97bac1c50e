//! The interface between contact and circuit.

use crate::grid::{ConductanceMap, PressureMap};

/// Turns the pressure on the taxels' electrodes into their conductance.
///
/// The pressure is that of the contact, unchanged: foam, Velostat and backing lie in series, so the balance of forces
/// transmits the pressure to the electrode at once and in full. Damping and stress relaxation of the foam change the
/// depth that belongs to a pressure. They are part of the contact field, which knows both.
///
/// State lasts from press to press of one session: run the presses on the same transducer, with [`Transducer::rest`]
/// between them. Every implementation passes [`check_transducer`](crate::check_transducer).
///
/// ```
/// use spts_models::{ConductanceMap, PressureMap, SkinLayout, Streams, build_transducer};
///
/// let skin = SkinLayout::default();
/// let mut sheet = build_transducer("velostat", toml::Table::new(), &skin, Streams::new(1))?;
/// let pressure = PressureMap::from_values(10, 10, vec![10e3; 100]);
/// let (mut early, mut late) = (ConductanceMap::zeros(10, 10), ConductanceMap::zeros(10, 10));
/// sheet.step(&pressure, 0.01, &mut early);
/// sheet.step(&pressure, 1.0, &mut late);
/// assert!(late.sum() > early.sum(), "Velostat creeps under a constant pressure");
/// # Ok::<(), spts_models::TransducerError>(())
/// ```
pub trait Transducer: Send + Sync {
    /// Advances the state by `dt_s` seconds under `pressure`, Pa, and writes the conductance at the end of the step, S,
    /// to `out`.
    ///
    /// `pressure` and `out` have the shape of the skin. The pressure is constant from the start of the step to its end:
    /// one long step and several short ones under the same pressure give the same result. `dt_s` may be zero; `out` is
    /// then the instantaneous conductance. Negative pressure and NaN count as zero.
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap);

    /// Leaves the skin unloaded for `dt_s` seconds, as between two presses.
    fn rest(&mut self, dt_s: f64);

    /// Starts session number `session` on the same skin: presses are forgotten, and whatever varies between sessions is
    /// drawn again. The draws depend only on the number and the skin. A fresh transducer is in session 0.
    fn start_session(&mut self, session: u64);

    /// A copy including its state, so that one transducer serves many sessions.
    fn boxed(&self) -> Box<dyn Transducer>;
}

/// Time constants count from zero; a step that is negative or NaN is none.
pub(crate) fn elapsed_s(dt_s: f64) -> f64 {
    if dt_s > 0.0 { dt_s } else { 0.0 }
}

/// Pressure as the materials see it, Pa: not negative, and bounded so that no formula overflows.
pub(crate) fn loaded_pa(pressure_pa: f64) -> f64 {
    // the comparison is false for NaN
    if pressure_pa > 0.0 { pressure_pa.min(1e12) } else { 0.0 }
}
