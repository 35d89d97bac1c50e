//! Where the weights of a recording come from.

use super::error::ChainError;

/// Where the weights of the taxels in a recording come from: a formula, or emulated cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightSource {
    /// Computed by the formula of the cells' generator.
    Model,
    /// The codes of emulated cells that run the shipped firmware: [`FirmwareCells`](super::FirmwareCells).
    Firmware,
}

/// Every source of weights, with the name that a scene gives to it.
pub const WEIGHT_SOURCES: &[(&str, WeightSource)] =
    &[("model", WeightSource::Model), ("firmware", WeightSource::Firmware)];

/// Source of a scene that names none.
pub const DEFAULT_WEIGHTS: &str = "model";

impl WeightSource {
    /// The source called `name` in [`WEIGHT_SOURCES`].
    ///
    /// # Errors
    /// [`ChainError::UnknownWeights`] if the table has no such name.
    pub fn named(name: &str) -> Result<Self, ChainError> {
        let found = WEIGHT_SOURCES.iter().find(|(known, _)| *known == name);
        found.map(|(_, source)| *source).ok_or_else(|| {
            let known: Vec<&str> = WEIGHT_SOURCES.iter().map(|(known, _)| *known).collect();
            ChainError::UnknownWeights {
                name: name.to_owned(),
                known: known.join(", "),
            }
        })
    }
}
