//! One scene from its name or file to its frames and recordings.

mod error;
mod request;
mod run;
mod summary;

pub use error::SimulateError;
pub use request::{Prepared, Request};
pub use run::{Simulation, run};
pub use summary::{BounceSummary, PressSummary, Summary};
