//! Simulated presses that replace the skin's own images as input of the readout.

use super::replay::ReplayError;
use crate::calibrate::SessionPair;
use crate::pressed::footprint_scene;
use spts::record::Twin;
use spts::scene::Scene;
use spts_circuit::Interpolated;
use spts_contact::objects::OBJECTS;
use spts_eval::protocol::{PLATEAU, PUBLISHED_RATE_HZ, PUBLISHED_TAXELS};
use spts_models::{Streams, TaxelGains};
use std::path::Path;

/// The lift begins so long after the hold at least, s: as much as it scatters by.
const LIFT_AFTER_S: f64 = 0.04;

/// Presses of one object on one simulated skin.
pub(super) struct SimulatedPresses(Vec<Interpolated>);

impl SimulatedPresses {
    /// As many presses of the object of `pair` as its session has, on the skin that follows from `seed`: one with the
    /// given `gains`, or any.
    ///
    /// # Errors
    /// [`ReplayError`] when the simulation does not know the object, or fails.
    pub(super) fn of(pair: &SessionPair, seed: u64, gains: Option<&TaxelGains>) -> Result<Self, ReplayError> {
        let Some(object) = OBJECTS.iter().find(|object| object.name == pair.object) else {
            return Err(ReplayError::UnknownObject {
                session: pair.session.clone(),
                object: pair.object.clone(),
                known: OBJECTS.iter().map(|o| o.name).collect::<Vec<_>>().join(", "),
            });
        };
        let presses = pair.compressive.blocks().len();
        let mut config = footprint_scene(object.name, presses, seed);
        config.skin = *pair.compressive.layout();
        // the hold of the session, and everything that comes before and after it as usual
        let frame_s = pair.compressive.measurements_per_frame() as f64 / pair.compressive.sample_rate_hz();
        let published_s = PUBLISHED_TAXELS as f64 / PUBLISHED_RATE_HZ;
        let later_s = pair.hold.start as f64 * frame_s - PLATEAU.start as f64 * published_s;
        if let Some(press) = &mut config.press {
            press.onset_s += later_s;
            press.lift_s = (press.lift_s + later_s).max(pair.hold.end as f64 * frame_s + LIFT_AFTER_S);
            press.duration_s = (pair.compressive.frames() as f64 * frame_s).max(press.lift_s + press.fall_s);
        }
        if let Some(gains) = gains {
            let gains = toml::Value::try_from(gains).map_err(|e| ReplayError::Gains(e.to_string()))?;
            config.transducer_parameters.insert("gains".to_owned(), gains);
        }
        let failed = |error: spts::TwinError| ReplayError::Simulation(Box::new(error));
        let scene = Scene::new(config, Path::new("")).map_err(|e| failed(e.into()))?;
        let twin = Twin::new(&scene).map_err(failed)?;
        let frames = twin.presses(0..presses, &|| ()).map_err(failed)?;
        let acquisition = twin.acquisition(spts_circuit::Mode::Compressive);
        Ok(Self(twin.conductance(&frames, &acquisition).map_err(failed)?))
    }

    /// Conductance over time of press `block`.
    pub(super) fn press(&self, block: usize) -> Interpolated {
        self.0[block].clone()
    }
}

/// Seed of the simulated skin number `draw`.
pub(super) fn skin_seed(streams: Streams, draw: u64) -> u64 {
    use rand::RngExt as _;
    streams.rng("compare/skin", draw).random::<u64>() >> 1
}
