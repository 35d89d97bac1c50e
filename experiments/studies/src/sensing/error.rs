//! Why no rows are designed.

use spts::data::DataError;
use spts_circuit::WeightsError;
use spts_eval::training::LearnError;
use spts_recon::recover::PriorError;
use spts_recon::rows::RowError;

/// Why no rows are designed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SensingError {
    /// No rows of this kind.
    #[error(transparent)]
    Rows(#[from] RowError),
    /// Recordings that cannot be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Nothing to learn from.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// Images that make no prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// Rows that are no pattern.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}
