//! Simulates one scene, given by name or file, up to its frames and recordings.

mod error;
mod notes;
mod request;
mod run;
mod summary;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin_tests;

pub use error::SimulateError;
pub use request::{NAMED_SCENES, Prepared, Request};
pub use run::{Peak, Saturated, SimulatedPiece, Simulation, run};
pub use summary::{BounceSummary, PressSummary, Summary};
