//! Gaussian estimates of large sheets.

mod decoder;
mod error;
mod non_negative;
mod prior;
#[cfg(test)]
mod tests;

pub use decoder::{SheetDecoder, SheetNoise};
pub use error::SheetError;
pub use prior::SheetPrior;
