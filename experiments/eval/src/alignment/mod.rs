//! Finds blocks whose cells have missed clock edges, and realigns them with their rows.
//!
//! A recording states the row of weights of every measurement. If all cells miss an edge, the samples lag behind these
//! rows from then on, also in later blocks. A chunk of a few hundred measurements of a contact reveals this: the
//! residual of an image fitted to it is 0.1 to 0.5 of the output if the rows are correct. If they are not, it is √(1 −
//! N/L) of the output, as for N free parameters and L random numbers. [`find_slips`] follows every block chunk by
//! chunk, searches other rows where the fit fails, and finds the measurement at which the rows change. An untouched
//! skin gives no information: a slip there is found at the next contact.
//!
//! ```
//! use spts_circuit::{Block, Recording, RecordingInfo, Seeding, Slip, WeightMode, Weights};
//! use spts_eval::find_slips;
//! use spts_models::SkinLayout;
//!
//! // taxel 3 is touched for 2000 measurements, and the samples are 34 behind their rows
//! let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 16);
//! let info = RecordingInfo::new(SkinLayout::new(4, 4, 5e-3, 3e-3)?, weights.clone(), 64_300.0);
//! let touched = |m: u64| if (1000..3000).contains(&m) { weights.level(3, 16_000 + m - 34) } else { 0.0 };
//! let block = Block { frame_position: 1250, idle_frames: None, volts: (0..4000).map(touched).collect() };
//! let recording = Recording::new(info, vec![block])?;
//! let slips = find_slips(&recording);
//! assert_eq!(slips, [Slip { block: 0, from: 0, rows: 34 }]);
//! assert_eq!(find_slips(&recording.realigned(&slips)), []);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod search;
#[cfg(test)]
mod tests;
mod track;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts::Session;
use spts::data::SessionSet;
use spts_circuit::{Mode, Recording, Slip};
use track::Tracker;

/// Most taxels of a skin whose recordings are checked: the search takes time with the square of their number.
const MOST_TAXELS: usize = 1024;

/// A place in a session from which on the samples lag behind the rows that the recording states.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionSlip {
    /// Name of the session.
    pub session: String,
    /// Where its samples begin to lag, and by how many rows.
    #[serde(flatten)]
    pub slip: Slip,
}

/// The slips of `recording`, in order of block and measurement; empty if there are none. If a block lags at its first
/// contact, the lag is assumed from its first measurement on. Raster scans, skins of more than 1024 taxels, and blocks
/// shorter than a chunk are not checked.
#[must_use]
pub fn find_slips(recording: &Recording) -> Vec<Slip> {
    if recording.mode() != Mode::Compressive || recording.taxels() > MOST_TAXELS {
        return Vec::new();
    }
    let mut tracker = Tracker::new(recording);
    (0..recording.blocks().len()).for_each(|block| tracker.follow(block));
    tracker.into_slips()
}

/// Realigns the compressive recordings of `set` where they slip, and returns the slips.
pub fn follow_slips(set: &mut SessionSet) -> Vec<SessionSlip> {
    let follow = |session: &mut Session| {
        let Some(recorded) = &mut session.compressive else {
            return Vec::new();
        };
        let slips = find_slips(&recorded.recording);
        if !slips.is_empty() {
            recorded.recording = recorded.recording.realigned(&slips);
        }
        let named = slips.into_iter().map(|slip| SessionSlip {
            session: session.name.clone(),
            slip,
        });
        named.collect()
    };
    let found: Vec<Vec<SessionSlip>> = set.sessions.par_iter_mut().map(follow).collect();
    found.concat()
}

/// One line that lists the sessions that slip, by how many rows, and from where; `None` without slips.
///
/// ```
/// use spts_circuit::Slip;
/// use spts_eval::{SessionSlip, slips_text};
///
/// assert_eq!(slips_text(&[]), None);
/// let slip = SessionSlip { session: "cup".to_owned(), slip: Slip { block: 2, from: 4100, rows: 1 } };
/// assert!(slips_text(&[slip]).expect("a line").contains("cup"));
/// ```
#[must_use]
pub fn slips_text(slips: &[SessionSlip]) -> Option<String> {
    /// Places of a session that are named.
    const NAMED: usize = 3;
    let sessions = crate::unique(slips.iter().map(|slip| slip.session.as_str()));
    let each = sessions.iter().map(|name| {
        let of_session: Vec<&Slip> = slips.iter().filter(|s| s.session == *name).map(|s| &s.slip).collect();
        let places = of_session.iter().take(NAMED).map(|slip| {
            let Slip { block, from, rows } = slip;
            format!("{rows} rows from measurement {from} of block {block} on")
        });
        let more = of_session.len().saturating_sub(NAMED);
        let more = if more > 0 {
            format!(" and {more} more")
        } else {
            String::new()
        };
        format!("{name} ({}{more})", places.collect::<Vec<_>>().join(", "))
    });
    let each: Vec<String> = each.collect();
    (!each.is_empty()).then(|| {
        format!(
            "clock edges were missed; samples are put back on their rows: {}",
            each.join("; ")
        )
    })
}
