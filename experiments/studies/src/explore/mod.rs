//! How many measurements a large skin needs, on one wire or several, with the limits of the electronics in the loop.

mod error;
mod fit;
mod measure;
mod report;
pub(crate) mod scene;
mod study;
mod text;
pub(crate) mod wiring;

pub use error::ExploreError;
pub use fit::PowerLaw;
pub use report::{CostFit, ExploreReport, SizeRow, Trial};
pub use study::{ExploreStudy, WANTED_IOU, WANTED_LOCATED};
pub use wiring::Way;
