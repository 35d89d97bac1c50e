//! The twin against recordings of the skin it is the twin of: the same images, the same rows of weights, the same
//! estimators.
//!
//! The readout is calibrated on every other press of a session and compared on the others, so the comparison can fail.

mod curves;
mod replay;
mod statistics;
mod study;
mod text;

pub use curves::{CurveDistance, MEASUREMENTS, ScoreCurves, curves, steps as curves_steps};
pub use replay::{ReplayError, replay};
pub use statistics::{Statistic, not_modelled, statistics};
pub use study::{CompareError, CompareReport, CompareStudy};
pub use text::with_error;

use crate::calibrate::{FittedReadout, SessionEstimates, SessionPair, fitted_profile};
use rayon::prelude::*;
use spts_circuit::Recording;
use spts_models::Streams;

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

/// Calibrates, replays and analyses one session.
///
/// # Errors
/// [`ReplayError`] when it has too few presses, a press cannot be fitted, or the readout refuses what was fitted.
pub fn compare(pair: &SessionPair, streams: Streams) -> Result<ComparedSession, ReplayError> {
    let session = pair.session.as_str();
    let unfit = || ReplayError::Unfit {
        session: session.to_owned(),
    };
    let (calibration, compared) = split(&pair.compressive).ok_or_else(|| ReplayError::OnePress {
        session: session.to_owned(),
    })?;
    let estimate = |recording: &Recording, blocks: &[usize]| SessionEstimates::of(pair, recording, blocks);
    let fitted = estimate(&pair.compressive, &calibration).ok_or_else(unfit)?;
    let real = estimate(&pair.compressive, &compared).ok_or_else(unfit)?;
    let readings = FittedReadout::of(std::slice::from_ref(&fitted));
    let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
    let (profile, _) = fitted_profile(&readings, taxels)?;
    let label = streams.child(&format!("compare/{session}"), 0);
    let recording = replay(&pair.compressive, &compared, &fitted, &profile, label)?;
    let twin = estimate(&recording, &compared).ok_or_else(unfit)?;
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
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ComparedSession>, ReplayError> {
    let one = |pair| {
        let compared = compare(pair, streams);
        done();
        compared
    };
    pairs.par_iter().map(one).collect()
}
