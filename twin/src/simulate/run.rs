//! The mechanics of every press, and their recordings.

use super::error::SimulateError;
use super::request::Prepared;
use crate::record::{PressFrames, Twin};
use crate::session::Session;
use spts_circuit::Mode;
use spts_contact::Frame;
use spts_models::ConductanceMap;
use std::time::{Duration, Instant};

/// Everything one run produced.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Presses or drops.
    pub presses: Vec<PressFrames>,
    /// Conductance of the taxels at every frame, in the session of the raster recording.
    pub conductance: Vec<Vec<ConductanceMap>>,
    /// The session, unless no recording was asked for.
    pub session: Option<Session>,
    /// Time the mechanics took.
    pub mechanics: Duration,
    /// Time the transducer and the readouts took.
    pub recording: Duration,
}

impl Simulation {
    /// Press and frame with the largest normal force; the first one of several.
    #[must_use]
    pub fn peak(&self) -> Option<(usize, usize)> {
        let all = self.presses.iter().enumerate().flat_map(|(press, p)| {
            let forces = p.frames.iter().enumerate();
            forces.map(move |(frame, f)| (press, frame, f.wrench.force_n[2]))
        });
        all.reduce(|best, next| if next.2 > best.2 { next } else { best })
            .map(|(press, frame, _)| (press, frame))
    }

    /// The frame of [`Simulation::peak`].
    #[must_use]
    pub fn peak_frame(&self) -> Option<&Frame> {
        self.peak().map(|(press, frame)| &self.presses[press].frames[frame])
    }
}

/// Runs all presses of the scene, in parallel, and records them in both modes when `record` says so, each as
/// [`Twin::record`] does; in the compressive one alone where emulated cells cannot scan the skin. `done` is called
/// after each press. The result does not depend on the number of threads.
///
/// # Errors
/// [`SimulateError`] when the scene is too large, its weights cannot come from the firmware, or the mechanics or the
/// readout fail.
pub fn run(prepared: &Prepared, record: bool, done: &(dyn Fn() + Sync)) -> Result<Simulation, SimulateError> {
    let twin = Twin::new(&prepared.scene)?;
    if record {
        twin.check(Mode::Compressive)?;
    }
    let start = Instant::now();
    let presses = twin.presses(0..prepared.scene.repeats(), done)?;
    let mechanics = start.elapsed();
    let scanned = twin.check(Mode::Raster).is_ok();
    let raster = twin.acquisition(Mode::Raster);
    let mut sources = twin.conductance(&presses, &raster)?;
    let conductance = sources.iter().map(|source| source.maps().to_vec()).collect();
    let session = if record {
        let (raster, compressive) = rayon::join(
            || scanned.then(|| twin.read_out(&presses, &mut sources, &raster)),
            || twin.recorded(&presses, &twin.acquisition(Mode::Compressive)),
        );
        Some(twin.session(raster.transpose()?, Some(compressive?)))
    } else {
        None
    };
    Ok(Simulation {
        presses,
        conductance,
        session,
        recording: start.elapsed() - mechanics,
        mechanics,
    })
}
