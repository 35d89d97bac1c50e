//! The cells' firmware on emulated controllers, compared with the weights that the twin assumes.

mod cells;
mod edges;
mod error;
mod late;
mod lost;
mod study;
mod task;
mod text;
mod timing;
mod trace;
mod verify;
mod weights;

pub use cells::{EmulatedCells, image};
pub use error::{CellFailure, FirmwareError};
pub use late::LateUpdates;
pub use study::{ImageTiming, LostEdges, time_images};
pub use task::CellTask;
pub use text::{timing_text, verification_text};
pub use timing::{DESIGN_EDGE_HZ, ModeTiming};
pub use verify::{Mismatch, ModeVerification, Verification};
pub use weights::EmulatedWeights;
