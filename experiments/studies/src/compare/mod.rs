//! The twin against recordings of the skin it is the twin of: the same images, the same rows of weights, the same
//! estimators.
//!
//! The readout is calibrated on every other press of a session and compared on the others, or it is fitted to other
//! sessions: so the comparison can fail.

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
use spts_circuit::Recording;
use spts_models::{Streams, TaxelGains};

/// Real and twin estimates of one session, and the twin's recording.
#[derive(Debug, Clone)]
pub struct ComparedSession {
    /// Estimates of the skin's presses that are compared.
    pub real: SessionEstimates,
    /// Estimates of the twin's.
    pub twin: SessionEstimates,
    /// The readout that was fitted to the calibration presses.
    pub readings: FittedReadout,
    /// The twin's session; presses that are not compared are the skin's own.
    pub recording: Recording,
}

/// Presses (0-based) that calibrate a session, and those that are compared: the first, third, … and the second, fourth,
/// …. The readout drifts in the course of a session (the first tap of the memory by 0.01), so that neither half may be
/// the earlier one. `None` with one press.
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

/// Calibrates, replays and analyses one session, with the skin's own images or with those of the skin that is simulated
/// with `streams`, its gains as given.
///
/// # Errors
/// [`ReplayError`] when it has too few presses, a press cannot be fitted, or the readout refuses what was fitted.
pub fn compare(
    pair: &SessionPair,
    (images, gains): (Images, Option<&TaxelGains>),
    streams: Streams,
) -> Result<ComparedSession, ReplayError> {
    let session = pair.session.as_str();
    let (calibration, compared) = split(&pair.compressive).ok_or_else(|| ReplayError::OnePress {
        session: session.to_owned(),
    })?;
    let estimate = |recording: &Recording, blocks: &[usize]| SessionEstimates::of(pair, recording, blocks);
    let fitted = estimate(&pair.compressive, &calibration).ok_or_else(|| unfit(pair))?;
    let real = estimate(&pair.compressive, &compared).ok_or_else(|| unfit(pair))?;
    let readings = FittedReadout::of(std::slice::from_ref(&fitted));
    let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
    let (profile, _) = fitted_profile(&readings, taxels)?;
    let label = streams.child(&format!("compare/{session}"), 0);
    let recording = match images {
        Images::Recorded => {
            let images = recorded_images(&pair.compressive, &fitted, &profile);
            replay(&pair.compressive, &compared, &images, &profile, label, 0)?
        }
        Images::Simulated => {
            let presses = SimulatedPresses::of(pair, skin_seed(streams, 0), gains)?;
            let images = |block| Ok(presses.press(block));
            replay(&pair.compressive, &compared, &images, &profile, label, 0)?
        }
    };
    let twin = estimate(&recording, &compared).ok_or_else(|| unfit(pair))?;
    Ok(ComparedSession {
        real,
        twin,
        readings,
        recording,
    })
}

/// [`compare`] for every session; `done` is called after each.
///
/// # Errors
/// The first session's that cannot be compared.
pub fn compare_all(
    pairs: &[SessionPair],
    images: (Images, Option<&TaxelGains>),
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
