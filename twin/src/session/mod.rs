//! Sessions: recordings of one object or event, with everything known about them.
//!
//! ```
//! use spts::session::{Event, Recorded, Session};
//! use spts::{Block, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
//!
//! // one block of ten frames on a skin of 1 × 8 taxels
//! let layout = SkinLayout::new(1, 8, 5e-3, 3e-3)?;
//! let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
//! let block = Block { frame_position: 10, idle_frames: Some(2), volts: vec![0.25; 80] };
//! let session = Session {
//!     compressive: Some(Recorded::new(Recording::new(info, vec![block])?)),
//!     ..Session::new("cup", Event::Press)
//! };
//! # let dir = std::env::temp_dir().join(format!("spts-doc-session-{}", std::process::id()));
//! session.write(&dir)?;
//! assert_eq!(Session::read(&dir)?, session);
//! # std::fs::remove_dir_all(&dir)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrays;
mod check;
mod codes;
mod contents;
mod error;
mod folder;
mod npy_header;
mod samples;
#[cfg(test)]
mod tests;
mod writer;

pub use arrays::{MOST_SAMPLES, NpyArray, read_npy};
#[cfg(feature = "mujoco")]
pub(crate) use check::{NAMES, is_plain};
pub use error::SessionError;
pub use folder::{SCHEMA, SESSION_FILE};
pub use npy_header::{npy_values, read_npy_header, room};
pub use writer::SessionWriter;

use crate::provenance::Provenance;
use serde::{Deserialize, Serialize};
use spts_circuit::Recording;
use spts_models::{ConductanceMap, PressureMap, SkinLayout};

/// What happened in every block of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// Something was pressed on the skin and held.
    Press,
    /// Something fell on the skin.
    Drop,
    /// Something touched the skin, at an unknown time.
    Touch,
}

/// Position and orientation of the pressed body, in the frame of the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressPose {
    /// Position of the body's origin, m.
    pub position_m: [f64; 3],
    /// Orientation, unit quaternion (w, x, y, z).
    pub quaternion: [f64; 4],
}

/// Facts about one block of a recording beside its samples. A simulation knows all of them, a real skin hardly any.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressFacts {
    /// Time within the block to which the other facts refer, s: the middle of the hold, or the instant of the largest
    /// force.
    pub time_s: Option<f64>,
    /// Pose of the pressed body.
    pub pose: Option<PressPose>,
    /// Normal force on the skin, N.
    pub force_n: Option<f64>,
    /// Mean pressure over each taxel's area (pitch × pitch), Pa.
    pub pressure: Option<PressureMap>,
    /// Conductance of each taxel, S, as the readout saw it.
    pub conductance: Option<ConductanceMap>,
}

/// A recording, with the facts known about its blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The samples, and the rows of weights with which they were taken.
    pub recording: Recording,
    /// Number of blocks at the beginning that only condition the skin. They are not scored.
    pub conditioning: usize,
    /// Facts about each block; empty if nothing is known.
    pub presses: Vec<PressFacts>,
}

impl Recorded {
    /// A recording without facts about its blocks.
    #[must_use]
    pub fn new(recording: Recording) -> Self {
        Self {
            recording,
            conditioning: 0,
            presses: Vec::new(),
        }
    }

    /// The facts about block `block`.
    #[must_use]
    pub fn facts(&self, block: usize) -> Option<&PressFacts> {
        self.presses.get(block)
    }
}

/// Recordings of one object or event on one skin, raster and compressive, with what is known of every press.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Name that identifies the session within a set. It must be valid as a file name; spaces are allowed.
    pub name: String,
    /// What was pressed or dropped: the class that a classifier is to find. Several sessions may share it.
    pub object: String,
    /// What happened in every block.
    pub event: Event,
    /// Span [start, end) of a block in which the contact is steady, s; `None` if it is not known, as for a drop.
    pub hold_s: Option<[f64; 2]>,
    /// The raster recording.
    pub raster: Option<Recorded>,
    /// The compressive recording.
    pub compressive: Option<Recorded>,
    /// Provenance of a simulated session; `None` for a real skin.
    pub provenance: Option<Provenance>,
}

impl Session {
    /// A session called `name`, of the object with that name, without recordings.
    #[must_use]
    pub fn new(name: &str, event: Event) -> Self {
        Self {
            name: name.to_owned(),
            object: name.to_owned(),
            event,
            hold_s: None,
            raster: None,
            compressive: None,
            provenance: None,
        }
    }

    /// The raster recording.
    #[must_use]
    pub fn raster(&self) -> Option<&Recording> {
        self.raster.as_ref().map(|r| &r.recording)
    }

    /// The compressive recording.
    #[must_use]
    pub fn compressive(&self) -> Option<&Recording> {
        self.compressive.as_ref().map(|r| &r.recording)
    }

    /// Layout of the skin; `None` without a recording.
    #[must_use]
    pub fn layout(&self) -> Option<&SkinLayout> {
        self.compressive().or(self.raster()).map(Recording::layout)
    }
}
