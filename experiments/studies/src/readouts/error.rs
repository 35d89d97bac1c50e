//! Errors of the readouts study.

use crate::explore::ExploreError;
use crate::touches::TouchError;
use spts_input::Refusal;

/// Why there is no [`ReadoutsReport`](super::ReadoutsReport).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadoutsError {
    /// The electronics of as_designed cannot be used.
    #[error(transparent)]
    Electronics(#[from] Refusal),
    /// The wire of a size cannot be built.
    #[error(transparent)]
    Wiring(#[from] ExploreError),
    /// The amplifier, the skin or the readout of a wire cannot be built, or the cells do not fit the wire.
    #[error(transparent)]
    Config(#[from] spts_models::ConfigError),
    /// A touch cannot be drawn or measured.
    #[error(transparent)]
    Touch(#[from] TouchError),
    /// The rows cannot be designed.
    #[error(transparent)]
    Rows(#[from] spts_recon::rows::RowError),
    /// There is no prior for the skin.
    #[error(transparent)]
    Learn(#[from] spts_eval::training::LearnError),
    /// There is no estimate for the rows.
    #[error(transparent)]
    Fixed(#[from] spts_recon::recover::FixedError),
    /// An image cannot be recovered.
    #[error(transparent)]
    Recover(#[from] spts_recon::RecoverError),
    /// An image of a large sheet cannot be recovered.
    #[error(transparent)]
    Sheet(#[from] spts_recon::matrix_free::SheetError),
    /// There is no prior for a large sheet.
    #[error(transparent)]
    Prior(#[from] spts_recon::recover::PriorError),
    /// An effect of the profile is missing, or lacks a value.
    #[error("profile as_built or as_designed: no `compressive.{effect}.{number}`")]
    NoNumber {
        /// Effect.
        effect: &'static str,
        /// Name of the value.
        number: &'static str,
    },
}
