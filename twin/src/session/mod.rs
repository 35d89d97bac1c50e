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

mod folder;
mod npy;
mod recorded;
#[cfg(test)]
mod tests;

pub use folder::{SESSION_FILE, SessionWriter, parse_json};
pub use npy::{MOST_SAMPLES, NpyArray, read_npy};
pub use recorded::{Event, PressFacts, PressPose, Recorded, Session};
pub(crate) use recorded::{NAMES, is_plain};
