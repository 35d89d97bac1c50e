//! The summing amplifier with skins of any size, in closed form, and what larger skins need.

mod designed;
mod error;
mod one_wire;
mod study;
mod text;

pub use error::ElectronicsError;
pub use study::{ElectronicsReport, ElectronicsStudy};
pub use text::{TABLE_TAXELS, text};
