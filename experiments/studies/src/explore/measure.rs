//! Measurements of the wires of a large skin, and the corresponding operator.

use super::scene::ExploreScene;
use super::wiring::Wiring;
use rayon::prelude::*;
use spts_circuit::{Constant, INCREMENT, MULTIPLIER, Mode, Readout};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::operator::{Centred, SignGenerator, SignOperator, SubArrays, centre};

/// The bit of a binary cell's generator that is its sign: the top byte is 128 or more where it is set.
const SIGN_BIT: u32 = 31;

/// Operator of all wires.
pub(super) type Wired = SubArrays<Centred<SignOperator>>;

/// One wire, pressed and idle, from its first measurement on.
struct Wire {
    pressed: (Readout, Constant),
    idle: (Readout, Constant),
    seeds: Vec<u32>,
    /// Pressed minus idle, V.
    volts: Vec<f64>,
}

/// A skin under one scene, measured as far as was asked for.
pub(super) struct MeasuredWires {
    wires: Vec<Wire>,
    generator: SignGenerator,
}

impl MeasuredWires {
    /// The skin `wiring` under `scene`; no measurement yet. The idle skin was recorded from the same rows on in a
    /// session before: it holds what the cells and the idle conductance add.
    pub(super) fn new(wiring: &Wiring, scene: &ExploreScene, idle_s: f64, streams: Streams) -> Result<Self, Refusal> {
        let (taxels, skin) = (scene.image_s.len(), SkinLayout::default());
        let mut wires = Vec::with_capacity(wiring.wires);
        for w in 0..wiring.wires {
            let band = w * taxels / wiring.wires..(w + 1) * taxels / wiring.wires;
            // one wire's taxels, whatever their places
            let layout = SkinLayout::new(1, band.len(), skin.pitch_m(), skin.electrode_m())?;
            let device = streams.child("explore/wire", w as u64);
            let line = |session: u64, conductance_s: Vec<f64>| -> Result<(Readout, Constant), Refusal> {
                let readout = Readout::new(&wiring.profile, Mode::Compressive, &layout, device, session);
                let map = ConductanceMap::from_values(1, conductance_s.len(), conductance_s);
                Ok((
                    readout.map_err(Refusal::from_error)?,
                    Constant::new(map).map_err(Refusal::from_error)?,
                ))
            };
            let conductance_s = scene.image_s[band.clone()].iter().map(|g| g + idle_s).collect();
            let pressed = line(1, conductance_s)?;
            let weights = pressed.0.weights().clone();
            wires.push(Wire {
                idle: line(0, vec![idle_s; band.len()])?,
                pressed,
                seeds: (0..band.len()).filter_map(|k| weights.seed(k)).collect(),
                volts: Vec::new(),
            });
        }
        let generator = SignGenerator::new(MULTIPLIER, INCREMENT, SIGN_BIT).map_err(Refusal::from_error)?;
        Ok(Self { wires, generator })
    }

    /// The first `rows` measurements of every wire, V, wire after wire, and their operator; the mean of every wire is
    /// taken off, which holds what the drives' asymmetry makes of all that is pressed.
    pub(super) fn first(&mut self, rows: usize) -> Result<(Wired, Vec<f64>), Refusal> {
        self.wires.par_iter_mut().try_for_each(|wire| wire.extend(rows))?;
        let operator = |wire: &Wire| Centred::new(SignOperator::new(self.generator, wire.seeds.clone(), 0, rows));
        let phi = SubArrays::new(self.wires.iter().map(operator).collect());
        let mut volts: Vec<f64> = self
            .wires
            .iter()
            .flat_map(|w| w.volts[..rows].iter().copied())
            .collect();
        volts.chunks_exact_mut(rows.max(1)).for_each(centre);
        Ok((phi, volts))
    }
}

impl Wire {
    /// Measures on until there are `rows` measurements.
    fn extend(&mut self, rows: usize) -> Result<(), Refusal> {
        let more = rows.saturating_sub(self.volts.len());
        if more == 0 {
            return Ok(());
        }
        let run = |(readout, source): &mut (Readout, Constant)| readout.measure(source, more);
        let (pressed, idle) = rayon::join(|| run(&mut self.pressed), || run(&mut self.idle));
        let (pressed, idle) = (
            pressed.map_err(Refusal::from_error)?,
            idle.map_err(Refusal::from_error)?,
        );
        self.volts.extend(pressed.iter().zip(&idle).map(|(p, i)| p - i));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::electronics::ElectronicsStudy;
    use crate::explore::scene::scene;
    use crate::explore::wiring::{Way, wirings};
    use spts_circuit::{Seeding, WeightMode, Weights};
    use spts_recon::LinearOperator as _;

    /// Any row of the circuit's weights, however far from the seeds, is a row of the recovery's operator.
    #[test]
    fn far_rows_are_the_circuits() {
        for (seeding, first_row) in [
            (Seeding::Address, 0),
            (Seeding::Mixed, 1_000_003),
            (Seeding::Mixed, (1 << 40) + 5),
        ] {
            let weights = Weights::new(WeightMode::Binary, seeding, 77);
            let generator = SignGenerator::new(MULTIPLIER, INCREMENT, SIGN_BIT).unwrap();
            let phi = SignOperator::new(generator, (0..77).map(|k| seeding.seed(k)).collect(), first_row, 9);
            let mut rows = vec![0.0; 9 * 77];
            weights.fill_rows(first_row, &mut rows);
            for (r, row) in rows.chunks(77).enumerate() {
                let (mut unit, mut found) = (vec![0.0; 9], vec![0.0; 77]);
                unit[r] = 1.0;
                phi.apply_adjoint(&unit, &mut found);
                assert_eq!(found, row, "row {first_row} + {r}");
            }
        }
    }

    /// The recovery's operator has the rows of the circuit's weights: ideal wires deliver Φx to rounding.
    #[test]
    fn ideal_wires_deliver_the_operator_times_the_image() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let scene = scene(40, 150e-6, Streams::new(1), 0);
        for seeding in [Seeding::Address, Seeding::Mixed] {
            let mut wiring = wirings(1600, &scene, seeding, &electronics).unwrap().swap_remove(0);
            assert_eq!(wiring.way, Way::Ideal);
            for wires in [1, 3] {
                wiring.wires = wires;
                let mut measured = MeasuredWires::new(&wiring, &scene, 1e-6, Streams::new(1)).unwrap();
                measured.first(10).unwrap();
                let (phi, volts) = measured.first(37).unwrap();
                let mut expected = vec![0.0; 37 * wires];
                phi.apply(&scene.image_s, &mut expected);
                for (v, e) in volts.iter().zip(&expected) {
                    let e = e * wiring.profile.volts_per_siemens();
                    // differences of sums of 1600 terms of up to 0.7 V, rounded
                    assert!((v - e).abs() < 1e-10, "{v} V against {e} V");
                }
            }
        }
    }
}
