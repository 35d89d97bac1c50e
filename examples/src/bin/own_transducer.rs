//! A transducer of your own in place of Velostat: a foil whose conductance saturates.
//!
//! `cargo run --release --bin own_transducer`

use examples::{Result, decode, show, window};
use spts::chain::Acquisition;
use spts::models::{Transducer, check_transducer};
use spts::{ConductanceMap, Mode, PressureMap, Scene, Twin};

/// G = G_max · p / (p + p_half): no memory, the same for all taxels.
#[derive(Clone, Copy)]
struct Foil {
    most_s: f64,
    half_pa: f64,
}

impl Transducer for Foil {
    /// Pressure on the electrodes in, conductance out. A material with memory would advance it by `dt_s` here.
    fn step(&mut self, pressure: &PressureMap, _dt_s: f64, out: &mut ConductanceMap) {
        for (g, p) in out.values_mut().iter_mut().zip(pressure.values()) {
            // what is no number counts as no pressure
            let p = if p.is_nan() { 0.0 } else { p.clamp(0.0, 1e12) };
            *g = self.most_s * p / (p + self.half_pa);
        }
    }

    fn rest(&mut self, _dt_s: f64) {}

    fn start_session(&mut self, _session: u64) {}

    fn boxed(&self) -> Box<dyn Transducer> {
        Box::new(*self)
    }
}

fn main() -> Result<()> {
    let foil = Foil { most_s: 3e-4, half_pa: 2e4 };
    // the promises that every transducer keeps; panics with the numbers when this one does not
    check_transducer(&|_| Box::new(foil));
    println!("the foil keeps the promises of a transducer");

    // contact and readout are those of a scene, the transducer between them is ours
    let scene = Scene::from_toml("[press]\nobject = 'T'\npresses = 1", ".".as_ref())?;
    let twin = Twin::new(&scene)?;
    let press = &twin.presses(0..1, &|| ())?[0];
    let chain = scene.chain().with_transducer(Box::new(foil));
    let acquisition = Acquisition::presses(Mode::Compressive, 0);
    let recording = chain.record(&[&press.frames], scene.duration_s(), &acquisition)?;

    // the true image: what the foil makes of the pressure in the middle of the hold
    let middle = press.frames.len() / 2;
    let truth = &chain.conductance_maps(&[&press.frames], 0)[0][middle];
    println!(
        "largest conductance {:.0} µS at {:.0} kPa; from 50 measurements:",
        1e6 * truth.max(),
        1e-3 * press.frames[middle].electrode_pressure.max()
    );
    let image = decode(&window(&recording, press.frames[middle].time_s, 50)?)?;
    show(&image, truth.values(), scene.skin().cols());
    Ok(())
}
