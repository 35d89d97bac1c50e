//! Compares the twin with recordings of its real skin: same images, same rows of weights, same estimators.
//!
//! The readout is calibrated on every other press of a session and compared on the others, or fitted to other sessions.
//! The comparison can therefore fail.

mod curves;
mod predicted;
mod replay;
mod simulated;
mod statistics;
mod study;
mod text;

pub use curves::{CurveDistance, MEASUREMENTS, ScoreCurves, curves, steps as curves_steps};
pub use predicted::{PredictedStatistic, Prediction, Predictor};
pub use replay::{PressSource, ReplayError, recorded_images, replay};
pub use statistics::{Statistic, not_modelled, statistics};
pub use study::{CompareError, CompareReport, CompareStudy, Images};
pub use text::with_error;

use crate::calibrate::{FittedReadout, SessionEstimates, SessionPair, fitted_profile};
use rayon::prelude::*;
use simulated::{SimulatedPresses, skin_seed};
use spts_circuit::{Profile, Recording};
use spts_models::Streams;

/// Estimates of one session of the real skin and of the twin, and the twin's recording.
#[derive(Debug, Clone)]
pub struct ComparedSession {
    /// Estimates from the skin's compared presses.
    pub real: SessionEstimates,
    /// Estimates from the twin's presses.
    pub twin: SessionEstimates,
    /// The readout fitted to the calibration presses.
    pub readings: FittedReadout,
    /// The twin's session. Presses that are not compared are the skin's own.
    pub recording: Recording,
}

/// Presses (from 0) for calibration, and for comparison: the first, third, … and the second, fourth, …. They alternate
/// because the readout drifts during a session (the first tap of the memory by 0.01). `None` for one press.
#[must_use]
pub fn split(recording: &Recording) -> Option<(Vec<usize>, Vec<usize>)> {
    let presses = recording.blocks().len();
    (presses > 1).then(|| ((0..presses).step_by(2).collect(), (1..presses).step_by(2).collect()))
}

/// Presses of a session that are compared.
///
/// # Errors
/// [`ReplayError::OnePress`].
fn compared_presses(pair: &SessionPair) -> Result<Vec<usize>, ReplayError> {
    let (_, compared) = split(&pair.compressive).ok_or_else(|| ReplayError::OnePress {
        session: pair.session.clone(),
    })?;
    Ok(compared)
}

fn unfit(pair: &SessionPair) -> ReplayError {
    ReplayError::Unfit {
        session: pair.session.clone(),
    }
}

/// The presses of `pair` that are compared, with `images`, through the readout with `profile`, in its session number
/// `draw`. Simulated images are of skin number `draw`, the same for all sessions. `fitted` says which cells of the
/// skin's own recording do not run their sequence.
///
/// # Errors
/// [`ReplayError`] when a press has no image or the readout refuses it.
fn twin_of(
    pair: &SessionPair,
    images: &Images,
    (fitted, profile): (&SessionEstimates, &Profile),
    streams: Streams,
    draw: u64,
) -> Result<Recording, ReplayError> {
    let real = &pair.compressive;
    let blocks = compared_presses(pair)?;
    let readout = streams.child(&format!("compare/{}", pair.session), 0);
    match images {
        Images::Recorded => {
            let images = recorded_images(real, fitted, profile);
            replay(real, &blocks, &images, profile, readout, draw)
        }
        Images::Simulated { gains } => {
            let presses = SimulatedPresses::of(pair, skin_seed(streams, draw), gains.as_ref())?;
            replay(real, &blocks, &|block| Ok(presses.press(block)), profile, readout, draw)
        }
    }
}

/// Calibrates, replays and analyses one session.
///
/// # Errors
/// [`ReplayError`] if there are too few presses, a press cannot be fitted, or the readout refuses the fitted values.
pub fn compare(pair: &SessionPair, images: &Images, streams: Streams) -> Result<ComparedSession, ReplayError> {
    let (calibration, compared) = split(&pair.compressive).ok_or_else(|| ReplayError::OnePress {
        session: pair.session.clone(),
    })?;
    let estimate = |recording: &Recording, blocks: &[usize]| SessionEstimates::of(pair, recording, blocks);
    let fitted = estimate(&pair.compressive, &calibration).ok_or_else(|| unfit(pair))?;
    let real = estimate(&pair.compressive, &compared).ok_or_else(|| unfit(pair))?;
    let readings = FittedReadout::of(std::slice::from_ref(&fitted));
    let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
    let (profile, _) = fitted_profile(&readings, taxels)?;
    let recording = twin_of(pair, images, (&fitted, &profile), streams, 0)?;
    let twin = estimate(&recording, &compared).ok_or_else(|| unfit(pair))?;
    Ok(ComparedSession {
        real,
        twin,
        readings,
        recording,
    })
}

/// [`compare`] for every session. `done` is called after each.
///
/// # Errors
/// The error of the first session that cannot be compared.
pub fn compare_all(
    pairs: &[SessionPair],
    images: &Images,
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ComparedSession>, ReplayError> {
    let one = |pair| {
        let compared = compare(pair, images, streams);
        done();
        compared
    };
    pairs.par_iter().map(one).collect()
}
