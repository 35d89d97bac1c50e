//! Rows of the sensing matrix, designed for a skin.

mod classes;
mod cost;
mod design;
mod error;
mod report;
mod rows_for;
mod study;
mod text;

pub use classes::ClassRow;
pub use cost::{CauseError, CostRow};
pub(crate) use design::load_s;
pub use design::{DesignImages, RowDesign, RowDesignReport};
pub use error::SensingError;
pub use report::{Equal, NamedRow, SensingReport, SensingRow};
pub use study::SensingStudy;
