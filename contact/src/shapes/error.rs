//! Why there is no shape.

use spts_models::ConfigError;

/// Why a shape could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// No family of that name.
    #[error("shape family \"{name}\" is not one of {known}")]
    Unknown {
        /// Name that was asked for.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A range is not valid.
    #[error(transparent)]
    Ranges(#[from] ConfigError),
    /// A family drew outlines that touch or cross themselves, again and again.
    #[error("shape family \"{family}\" has no closed solid for seed {seed} in {tries} tries")]
    NoSolid {
        /// Name of the family.
        family: &'static str,
        /// Seed of the shape.
        seed: u64,
        /// Drawings that were tried.
        tries: u64,
    },
}
