//! `spts firmware`: the cell's firmware on emulated controllers, against the weights that the twin assumes.

mod edges;
mod late;
mod lost;
mod picture;
mod plan;
mod study;
mod text;
mod timing;
mod trace;
mod verify;
mod weights;

pub use late::Lateness;
pub use plan::{Plan, image};
pub use study::{ImageStudy, Lost, STAGES, write_studies};
pub use text::{timing_text, verification_text};
pub use timing::{DESIGN_EDGE_HZ, ModeTiming};
pub use verify::{Mismatch, ModeVerification, Verification};
pub use weights::write_weights;
