//! Number of measurements that a large skin needs, on one or several wires, including the limits of the electronics.

mod fit;
mod measure;
mod report;
pub(crate) mod scene;
mod study;
pub(crate) mod wiring;

pub use fit::PowerLaw;
pub use report::{CostFit, ExploreReport, ExploreTrial, SizeRow};
pub use study::{ExploreStudy, WANTED_IOU, WANTED_LOCATED};
pub use wiring::Way;
