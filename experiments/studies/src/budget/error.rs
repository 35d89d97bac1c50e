//! Errors of the budget study.

use spts::chain::ChainError;
use spts::record::TwinError;
use spts_eval::ScoreError;
use spts_eval::training::LearnError;

/// Why a budget cannot be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BudgetError {
    /// No object is named.
    #[error("`--objects` names no object")]
    NoObject,
    /// An object that does not exist.
    #[error("`--objects`: `{name}` is neither \"all\" nor one of {known}")]
    UnknownObject {
        /// Requested name.
        name: String,
        /// All known names.
        known: String,
    },
    /// An object is named twice.
    #[error("`--objects`: `{name}` is there twice")]
    RepeatedObject {
        /// Its name.
        name: String,
    },
    /// A press is too short for this number of measurements.
    #[error(
        "`--measurements`: {m} is outside [1, {most}] on a skin of {taxels} taxels: a press has no room for a vote of windows of {m}"
    )]
    TooManyMeasurements {
        /// Number of measurements, M.
        m: usize,
        /// Largest M that fits.
        most: usize,
        /// Number of taxels, N.
        taxels: usize,
    },
    /// The twin cannot be run.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// A recording cannot be made.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The raster scans contain no training data.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// The presses cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
    /// The parameters that disable a part of the transducer cannot be read.
    #[error(transparent)]
    Part(#[from] toml::de::Error),
}
