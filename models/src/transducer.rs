//! The interface between contact and circuit.

use crate::layout::{ConductanceMap, PressureMap};
use crate::snapshot::Snapshot;

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
/// # Ok::<(), spts_input::Refusal>(())
/// ```
pub trait Transducer: Send + Sync {
    /// Advances the state by `dt_s` seconds under `pressure`, Pa, and writes the conductance at the end of the step, S,
    /// to `out`.
    ///
    /// `pressure` and `out` have the shape of the skin. The pressure is constant from the start of the step to its end:
    /// one long step and several short ones under the same pressure give the same result. `dt_s` may be zero; `out` is
    /// then the instantaneous conductance. Negative pressure and NaN count as zero.
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap);

    /// [`step`](Self::step) with pressure on the taxels `pressed` alone, Pa, in the order of their numbers. Writes the
    /// number and the conductance, S, of every taxel that conducts now or did before the step to `out`, in the same
    /// order; whatever is not there conducts nothing. Its cost is that of these taxels, not of the skin. `false`, and
    /// nothing is done: this transducer has no such way, or an untouched taxel conducts.
    fn step_touched(&mut self, pressed: &[(u32, f64)], dt_s: f64, out: &mut Vec<(u32, f64)>) -> bool {
        let _ = (pressed, dt_s, out);
        false
    }

    /// Leaves the skin unloaded for `dt_s` seconds, as between two presses.
    fn rest(&mut self, dt_s: f64);

    /// Starts session number `session` on the same skin: presses are forgotten, and whatever varies between sessions is
    /// drawn again. The draws depend only on the number and the skin. A fresh transducer is in session 0.
    fn start_session(&mut self, session: u64);

    /// Saves or loads its state in this session: what it remembers of earlier steps. By default it remembers nothing.
    fn exchange(&mut self, state: &mut Snapshot) {
        let _ = state;
    }

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

// Electrodes of another size than the one for which transducers are calibrated.

/// A transducer under electrodes of another area: an interdigitated electrode of twice the area has twice as many
/// fingers in parallel, or fingers of twice the length, and under the same pressure it conducts twice as much.
pub(crate) struct OnElectrode {
    calibrated: Box<dyn Transducer>,
    /// Area of the electrode divided by that of the calibrated electrode.
    relative_area: f64,
}

impl OnElectrode {
    /// `calibrated` under electrodes of `relative_area` times the calibrated area; itself where that is 1.
    pub(crate) fn wrap(calibrated: Box<dyn Transducer>, relative_area: f64) -> Box<dyn Transducer> {
        if relative_area.to_bits() == 1.0_f64.to_bits() {
            return calibrated;
        }
        Box::new(Self { calibrated, relative_area })
    }
}

impl Transducer for OnElectrode {
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap) {
        self.calibrated.step(pressure, dt_s, out);
        out.values_mut().iter_mut().for_each(|g| *g *= self.relative_area);
    }

    fn step_touched(&mut self, pressed: &[(u32, f64)], dt_s: f64, out: &mut Vec<(u32, f64)>) -> bool {
        let known = self.calibrated.step_touched(pressed, dt_s, out);
        out.iter_mut().for_each(|(_, g)| *g *= self.relative_area);
        known
    }

    fn rest(&mut self, dt_s: f64) {
        self.calibrated.rest(dt_s);
    }

    fn start_session(&mut self, session: u64) {
        self.calibrated.start_session(session);
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        self.calibrated.exchange(state);
    }

    fn boxed(&self) -> Box<dyn Transducer> {
        Box::new(Self { calibrated: self.calibrated.boxed(), relative_area: self.relative_area })
    }
}

#[cfg(test)]
mod tests {
    use crate::{ConductanceMap, PressureMap, SkinLayout, Streams, TRANSDUCERS, build_transducer};

    /// G ∝ area at the same pressure, one rounding apart, for every transducer; at 10 mm not a bit differs from the
    /// transducer alone.
    #[test]
    fn conductance_is_proportional_to_the_electrodes_area() {
        for (name, build) in TRANSDUCERS {
            let steps = |transducer: &mut dyn crate::Transducer| {
                let pressure = PressureMap::from_values(1, 3, vec![0.0, 3e3, 40e3]);
                let mut out = ConductanceMap::zeros(1, 3);
                for _ in 0..5 {
                    transducer.step(&pressure, 0.05, &mut out);
                }
                out.values().to_vec()
            };
            let skin = |electrode_m| SkinLayout::new(1, 3, 15e-3, electrode_m).unwrap();
            let on = |electrode_m: f64| {
                let skin = skin(electrode_m);
                let built = build_transducer(name, toml::Table::new(), &skin, Streams::new(4));
                steps(built.unwrap().boxed().as_mut())
            };
            let mut alone = build(toml::Table::new(), &skin(10e-3), Streams::new(4)).unwrap();
            let calibrated = steps(alone.as_mut());
            assert!(calibrated == on(10e-3), "{name}");
            for (g, half) in calibrated.iter().zip(on(5e-3)) {
                assert!((half - 0.25 * g).abs() <= 2.0 * f64::EPSILON * g, "{name}: {half}, {g}");
            }
        }
    }
}
