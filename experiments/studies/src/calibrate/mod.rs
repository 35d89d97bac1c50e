//! Calibration: what recordings of a skin say about its readout, with the uncertainty of each number.
//!
//! Every press of a session is fitted by itself, y = Φx + c, in windows short enough to follow creep, outliers first
//! found and then left out. The numbers of a session are means over its presses; their scatter over the presses gives
//! the standard error.

mod beat;
mod design;
mod error;
mod faults;
mod fit;
mod gains;
mod late;
mod memory;
mod overdriven;
mod press;
mod profile;
mod profile_text;
mod session;
mod statistics;
mod steps;
mod study;
#[cfg(test)]
mod tests;
mod text;

pub use beat::Beat;
pub(crate) use beat::beat;
pub use design::Reseeded;
pub use error::CalibrateError;
pub use faults::{CellFault, reseeded};
pub use fit::WINDOW_FRAMES;
pub(crate) use fit::{FitRequest, fit_windows};
pub use gains::{SessionGains, TaxelGain};
pub use late::LateCell;
pub use overdriven::Overdriven;
pub use press::PressNumbers;
pub use profile::{FittedParameter, FittedReadout, NOT_IDENTIFIABLE, NOT_MODELLED};
pub use profile_text::{FittedError, fitted_profile};
pub use session::{QUANTILES, SessionEstimates};
pub use statistics::{Estimated, OUTLIER_SD, quantiles};
pub use steps::ConverterSteps;
pub use study::{CalibrationReport, CalibrationStudy};
pub use text::table;

use spts::data::{DataError, SessionSet};
use spts_circuit::Recording;
use spts_eval::protocol::PLATEAU;
use std::path::Path;

/// Both sessions of an object; the raster session may be missing.
#[derive(Debug, Clone)]
pub struct SessionPair {
    /// Name of the session.
    pub object: String,
    /// Compressive session.
    pub compressive: Recording,
    /// Raster session.
    pub raster: Option<Recording>,
}

/// The sessions in `root` that have a compressive recording of presses, each long enough to be calibrated from.
///
/// # Errors
/// [`DataError`] when a session that is there cannot be used or ends before its plateau, or there is none.
pub fn read(root: &Path) -> Result<Vec<SessionPair>, DataError> {
    let set = SessionSet::open(root)?;
    let mut pairs = Vec::new();
    for session in set.presses() {
        let Some(compressive) = session.compressive() else {
            continue;
        };
        if compressive.frames() < PLATEAU.end {
            return Err(DataError::Unscorable {
                path: root.to_owned(),
                session: format!("{} compressive", session.name),
                field: "frames",
                value: compressive.frames().to_string(),
                needed: format!("at least {}", PLATEAU.end),
            });
        }
        pairs.push(SessionPair {
            object: session.name.clone(),
            compressive: compressive.clone(),
            raster: session.raster().cloned(),
        });
    }
    if pairs.is_empty() {
        return Err(DataError::Missing {
            path: root.join("presses/NAME/NAME_random2.mat"),
            needed_by: "calibration (a compressive session)".to_owned(),
        });
    }
    Ok(pairs)
}
