//! Simulates one scene, given by name or file, up to its frames and recordings.

mod request;
mod run;
mod summary;
#[cfg(test)]
mod tests;

pub use request::{NAMED_SCENES, Prepared, Request};
pub use run::{BounceSummary, CourseSummary, Peak, PressSummary, Saturated, SimulatedPiece, Simulation, run};
pub use summary::Summary;
