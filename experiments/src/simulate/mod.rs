//! One scene from its name or file to its result files.

mod error;
mod files;
mod picture;
mod request;
mod run;
mod summary;

pub use error::SimulateError;
pub use files::{Timing, write_results};
pub use request::{Prepared, Request};
pub use run::{Recordings, Simulation, run};
pub use summary::{BounceSummary, PressSummary, Summary};
