//! Reconstructs images of large skins without a dense sensing matrix.

mod patches;
mod pursuit;
mod sheet;

pub use patches::{OnSheet, Patches, Rows};
pub use pursuit::RegionPursuit;
pub use sheet::{SheetDecoder, SheetNoise, SheetPrior};
