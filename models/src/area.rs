//! Electrodes of another size than the one for which transducers are calibrated.

use crate::grid::{ConductanceMap, PressureMap};
use crate::transducer::Transducer;

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
        Box::new(Self {
            calibrated,
            relative_area,
        })
    }
}

impl Transducer for OnElectrode {
    fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap) {
        self.calibrated.step(pressure, dt_s, out);
        out.values_mut().iter_mut().for_each(|g| *g *= self.relative_area);
    }

    fn rest(&mut self, dt_s: f64) {
        self.calibrated.rest(dt_s);
    }

    fn start_session(&mut self, session: u64) {
        self.calibrated.start_session(session);
    }

    fn boxed(&self) -> Box<dyn Transducer> {
        Box::new(Self {
            calibrated: self.calibrated.boxed(),
            relative_area: self.relative_area,
        })
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
