//! The mechanics of every press, and their recordings.

use super::error::SimulateError;
use super::request::Prepared;
use crate::chain::Take;
use crate::provenance::Provenance;
use crate::scene::Task;
use crate::session::{Event, Session};
use crate::twin::{PressFrames, TwinError, hold_s, press_frames, recorded, recorded_from};
use rayon::prelude::*;
use spts_circuit::Mode;
use spts_models::ConductanceMap;
use spts_sim::Frame;
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

/// Session of the raster recording, and of the conductance that is shown; the compressive one is the next.
const RASTER_SESSION: u64 = 0;
/// Most values of one kind that a run may hold: 1 GiB.
const MOST_VALUES: usize = 1 << 27;

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

/// Runs all presses of the scene, in parallel, and records them in both modes when `record` says so; in the compressive
/// one alone where emulated cells cannot scan the skin. `done` is called after each press. The result does not depend
/// on the number of threads.
///
/// # Errors
/// [`SimulateError`] when the scene is too large, its weights cannot come from the firmware, or the mechanics or the readout fail.
pub fn run(prepared: &Prepared, record: bool, done: &(dyn Fn() + Sync)) -> Result<Simulation, SimulateError> {
    let scene = &prepared.scene;
    check_size(prepared, record)?;
    if record {
        scene.chain().check(Mode::Compressive)?;
    }
    let start = Instant::now();
    let presses: Vec<PressFrames> = (0..scene.repeats())
        .into_par_iter()
        .map(|index| {
            let frames = press_frames(scene, index);
            done();
            frames
        })
        .collect::<Result<_, TwinError>>()?;
    let mechanics = start.elapsed();
    let slices: Vec<&[Frame]> = presses.iter().map(|p| p.frames.as_slice()).collect();
    let (take, event) = match scene.task() {
        Task::Press(_) => (Take::presses as fn(Mode, u64) -> Take, Event::Press),
        Task::Drop(_) => (Take::drops as fn(Mode, u64) -> Take, Event::Drop),
    };
    let chain = scene.chain();
    let raster = take(Mode::Raster, RASTER_SESSION);
    let scanned = chain.check(Mode::Raster).is_ok();
    let mut sources = chain.conductance(&slices, &raster)?;
    let conductance = sources.iter().map(|source| source.maps().to_vec()).collect();
    let session = if record {
        let (raster, compressive) = rayon::join(
            || scanned.then(|| recorded_from(chain, scene, &slices, &mut sources, &raster)),
            || recorded(chain, scene, &slices, &take(Mode::Compressive, RASTER_SESSION + 1)),
        );
        Some(Session {
            object: scene.object().to_owned(),
            hold_s: hold_s(scene),
            raster: raster.transpose()?,
            compressive: Some(compressive?),
            provenance: Some(Provenance::new(scene.seed(), prepared.scene_hash.clone())),
            ..Session::new(scene.name(), event)
        })
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

fn check_size(prepared: &Prepared, record: bool) -> Result<(), SimulateError> {
    let scene = &prepared.scene;
    let each = |rate_hz: f64, values: usize, what| {
        #[expect(clippy::cast_possible_truncation, reason = "at most 60 s at 1 GHz")]
        let instants = (scene.duration_s() * rate_hz).ceil() as usize;
        let values = instants.saturating_mul(scene.repeats()).saturating_mul(values);
        if values > MOST_VALUES {
            return Err(SimulateError::TooLarge {
                what,
                values,
                most: MOST_VALUES,
            });
        }
        Ok(())
    };
    let taxels = scene.skin().taxels();
    each(
        1.0 / scene.mechanics().frame_interval_s(),
        taxels,
        "presses × frames × taxels",
    )?;
    if record {
        each(scene.chain().sample_rate_hz(), 1, "presses × measurements")?;
    }
    Ok(())
}
