//! Calibration: estimates the parameters of a skin's readout from recordings, with their uncertainty.
//!
//! Every press of a session is fitted separately, y = Φx + c, in windows short enough to follow creep. Outliers are
//! found first and then left out, and so are presses that missed. The values of a session are medians over its presses;
//! their scatter gives the standard error. A profile from several sessions has spans in which a new session is
//! expected.

mod beat;
mod design;
mod faults;
mod fit;
mod gains;
mod late;
mod memory;
mod missed;
mod overdriven;
mod parameters;
mod predict;
mod press;
mod profile;
mod profile_text;
mod session;
mod skin;
mod statistics;
mod steps;
mod study;
#[cfg(test)]
mod tests;
mod text;

pub use beat::Beat;
pub use design::Reseeded;
pub use faults::{CellFault, reseeded};
pub use fit::WINDOW_FRAMES;
pub(crate) use fit::{FitRequest, fit_windows};
pub use gains::{SessionGains, TaxelGain};
pub use late::LateCell;
pub use missed::MissedPress;
pub use overdriven::Overdriven;
pub use parameters::FittedParameter;
pub use predict::{COVERAGE, PredictedInside, PredictedNumber, predicted};
pub use press::PressNumbers;
pub use profile::{FittedReadout, NOT_IDENTIFIABLE, NOT_MODELLED};
pub use profile_text::fitted_profile;
pub use session::{QUANTILES, SessionEstimates};
pub use skin::{Mounting, ObjectCheck, SkinReport, SkinStudy};
pub use statistics::{Estimated, OUTLIER_SD, quantiles};
pub use steps::ConverterSteps;
pub use study::{CalibrationReport, CalibrationStudy};
pub use text::table;

use spts::data::{DataError, SessionSet};
use spts::session::Recorded;
use spts_circuit::{Recording, WeightMode};
use spts_eval::protocol::{PLATEAU, Protocol};
use spts_eval::{SessionSlip, follow_slips};
use std::ops::Range;
use std::path::Path;

/// Both recordings of a session; the raster recording may be missing.
#[derive(Debug, Clone)]
pub struct SessionPair {
    /// Name of the session.
    pub session: String,
    /// What was pressed.
    pub object: String,
    /// Compressive recording.
    pub compressive: Recording,
    /// Frames of the compressive recording in which the contact is steady.
    pub hold: Range<usize>,
    /// Raster recording, and its frames in which the contact is steady.
    pub raster: Option<(Recording, Range<usize>)>,
    /// Slips of the compressive recording, which has been realigned.
    pub slips: Vec<SessionSlip>,
}

/// The sessions in `root` with a compressive recording of presses, all usable for calibration.
///
/// # Errors
/// [`DataError`] if a session is not usable, has weights that are not binary, or holds its contact for less than
/// [`WINDOW_FRAMES`]; or if there is no session.
pub fn read(root: &Path) -> Result<Vec<SessionPair>, DataError> {
    let mut set = SessionSet::open(root)?;
    let slips = follow_slips(&mut set);
    let mut pairs = Vec::new();
    for session in set.presses() {
        let Some(recorded) = &session.compressive else {
            continue;
        };
        let compressive = &recorded.recording;
        let unfit = |field, value, needed| DataError::Unfit {
            path: root.to_owned(),
            session: format!("{} compressive", session.name),
            field,
            value,
            needed,
        };
        let mode = compressive.weights().mode();
        if mode != WeightMode::Binary {
            let (value, needed) = (format!("{:?}", mode.name()), format!("{:?}", WeightMode::Binary.name()));
            return Err(unfit("weights.mode", value, needed));
        }
        let held = held_frames(recorded, session.hold_s).unwrap_or_default();
        if held.len() < WINDOW_FRAMES {
            let value = format!("{} frames of {}", held.len(), compressive.frames());
            return Err(unfit("hold_s", value, format!("at least {WINDOW_FRAMES} frames")));
        }
        let raster = session.raster.as_ref();
        pairs.push(SessionPair {
            session: session.name.clone(),
            object: session.object.clone(),
            compressive: compressive.clone(),
            hold: held,
            slips: slips
                .iter()
                .filter(|slip| slip.session == session.name)
                .cloned()
                .collect(),
            raster: raster.and_then(|r| Some((r.recording.clone(), held_frames(r, session.hold_s)?))),
        });
    }
    if pairs.is_empty() {
        return Err(DataError::NoCompressive { path: root.to_owned() });
    }
    Ok(pairs)
}

/// Frames of `recorded` in which the contact is steady: those that are scored; of a hold like the published one,
/// [`PLATEAU`]. `None` when the recording ends before them.
fn held_frames(recorded: &Recorded, hold_s: Option<[f64; 2]>) -> Option<Range<usize>> {
    let recording = &recorded.recording;
    let measurements = recording.frames() * recording.measurements_per_frame();
    let end_s = measurements as f64 / recording.sample_rate_hz();
    if hold_s.is_some_and(|[start_s, _]| start_s >= end_s) {
        return None;
    }
    let scored = Protocol::of(recorded, hold_s);
    let held = scored.first_frame..scored.first_frame + scored.frames;
    let published = Protocol::default();
    let published = published.first_frame..(published.first_frame + published.frames).min(recording.frames());
    Some(if held == published && held.end >= PLATEAU.end {
        PLATEAU
    } else {
        held
    })
}
