//! Errors of shapes.

use spts_models::ConfigError;

/// Why a shape could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// No family of that name.
    #[error("shape family \"{name}\" is not one of {known}")]
    Unknown {
        /// Requested name.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A range that is not valid.
    #[error(transparent)]
    Ranges(#[from] ConfigError),
    /// A family whose outlines touch or cross themselves at every attempt.
    #[error("shape family \"{family}\" has no closed solid for seed {seed} in {tries} tries")]
    NoSolid {
        /// Name of the family.
        family: &'static str,
        /// Seed of the shape.
        seed: u64,
        /// Number of attempts.
        tries: u64,
    },
}
