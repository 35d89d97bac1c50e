//! Gaussian estimates of large sheets.

mod decoder;
mod prior;

pub use decoder::{SheetDecoder, SheetError, SheetNoise};
pub use prior::SheetPrior;
