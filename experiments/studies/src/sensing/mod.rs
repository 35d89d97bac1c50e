//! Rows of the sensing matrix that are designed for a skin.

mod design;
mod error;
mod text;

pub(crate) use design::load_s;
pub use design::{DesignImages, DesignReport, RowDesign};
pub use error::SensingError;
