//! Sends images through the twin's readout: the skin's own images, or others.

use crate::calibrate::{FitRequest, FittedError, SessionEstimates, WINDOW_FRAMES, fit_windows, reseeded};
use rayon::prelude::*;
use spts_circuit::{Block, Interpolated, Mode, Profile, Readout, Recording};
use spts_models::{ConductanceMap, Streams};

/// Why a session cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// There is only one press, so none is left for the comparison.
    #[error("{session} compressive: `presses` = 1 is outside [2, ∞): some calibrate, the others are compared")]
    OnePress {
        /// Object.
        session: String,
    },
    /// There is only one session, so none is left for the prediction.
    #[error("{session} compressive: the only session, and no other to fit a profile to; name a profile")]
    NoOthers {
        /// Session.
        session: String,
    },
    /// The simulation does not know the object.
    #[error("{session} compressive: `object` = {object:?} is not known to the simulation; known: {known}")]
    UnknownObject {
        /// Session.
        session: String,
        /// Its object.
        object: String,
        /// Names of the known objects.
        known: String,
    },
    /// The press could not be simulated.
    #[error("simulated presses: {0}")]
    Simulation(#[source] Box<spts::TwinError>),
    /// The gains are not valid in a scene.
    #[error("gains: {0}")]
    Gains(String),
    /// The samples do not determine an image.
    #[error("{session} compressive: no press can be fitted")]
    Unfit {
        /// Object.
        session: String,
    },
    /// The fitted values are not a valid profile.
    #[error("the fitted profile: {0}")]
    Fitted(#[from] FittedError),
    /// The readout refuses the profile, or could not record.
    #[error("readout: {0}")]
    Readout(#[from] spts_input::Refusal),
    /// The fitted image is not a valid conductance.
    #[error("conductance: {0}")]
    Source(#[source] spts_input::Refusal),
    /// The blocks do not form a valid recording.
    #[error(transparent)]
    Recording(spts_input::Refusal),
}

/// Conductance of a press as a function of time, by the number of the press.
pub type PressSource<'a> = dyn Fn(usize) -> Result<Interpolated, ReplayError> + Sync + 'a;

/// Records the presses `blocks` of `real` again: with the conductance from `source`, the same rows of weights, and the
/// readout `profile`, in session number `session`. The other presses are unchanged.
///
/// # Errors
/// [`ReplayError`] if a press has no conductance, or the readout refuses it.
pub fn replay(
    real: &Recording,
    blocks: &[usize],
    source: &PressSource<'_>,
    profile: &Profile,
    streams: Streams,
    session: u64,
) -> Result<Recording, ReplayError> {
    let profile = &profile.on(real.layout())?.with_weights(real.weights())?;
    let anew: Vec<(usize, Block)> = blocks
        .par_iter()
        .map(|&block| {
            let mut readout = Readout::new(profile, Mode::Compressive, real.layout(), streams, session)?;
            Ok((block, press(real, block, &mut source(block)?, &mut readout)?))
        })
        .collect::<Result<_, ReplayError>>()?;
    let mut all = real.blocks().to_vec();
    for (block, recorded) in anew {
        all[block] = recorded;
    }
    real.with_blocks(all).map_err(ReplayError::Recording)
}

fn press(
    real: &Recording,
    block: usize,
    source: &mut Interpolated,
    readout: &mut Readout,
) -> Result<Block, ReplayError> {
    let Block {
        frame_position,
        idle_frames,
        ..
    } = real.blocks()[block];
    readout.seek(block as u64, frame_position - real.frames() as u64);
    let anew = readout.acquire(source, real.frames() * real.measurements_per_frame())?;
    Ok(Block { idle_frames, ..anew })
}

/// Conductance of the skin in the presses of `real`, measured by least squares in windows of [`WINDOW_FRAMES`], for a
/// readout with `profile`.
///
/// The noise of the windows adds √(p/n) = 0.2 of one measurement's noise to the twin's output, 4 % of its variance. It
/// is constant within a window, so the estimators, which fit the image again, are not affected.
pub fn recorded_images<'a>(
    real: &'a Recording,
    fitted: &'a SessionEstimates,
    profile: &'a Profile,
) -> impl Fn(usize) -> Result<Interpolated, ReplayError> + Sync + 'a {
    move |block| conductance(real, block, fitted, profile)
}

/// Conductance of the skin in the course of a press, S: the image at the middle of every window, joined by straight
/// lines.
fn conductance(
    real: &Recording,
    block: usize,
    fitted: &SessionEstimates,
    profile: &Profile,
) -> Result<Interpolated, ReplayError> {
    let cells = reseeded(&fitted.faults);
    let ask = FitRequest {
        block,
        reseeded: &cells,
        parity: false,
    };
    let windows = fit_windows(real, ask, 0..real.frames(), WINDOW_FRAMES);
    let middle_s = |first_row: u64| {
        let before = (first_row - real.first_row(block, 0)) as f64;
        (before + 0.5 * (WINDOW_FRAMES * real.measurements_per_frame()) as f64) / profile.sample_rate_hz
    };
    let (mut times_s, mut maps) = (Vec::new(), Vec::new());
    for window in windows {
        times_s.push(middle_s(window.first_row));
        let mut image = window.image;
        for cell in &fitted.overdriven {
            image[cell.taxel as usize] *= cell.over_binary;
        }
        // noise of taxels that carry nothing may be below 0; no conductance is
        let siemens = image.iter().map(|x| x.max(0.0) / profile.volts_per_siemens());
        maps.push(ConductanceMap::from_values(1, real.taxels(), siemens.collect()));
    }
    Interpolated::new(times_s, maps).map_err(ReplayError::Source)
}
