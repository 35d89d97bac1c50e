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
    /// Touches that cannot be pressed or measured.
    #[error(transparent)]
    Touch(#[from] crate::touches::TouchError),
    /// A readout that is not there.
    #[error(transparent)]
    Profile(#[from] spts_circuit::ProfileError),
    /// Windows that cannot be answered.
    #[error(transparent)]
    Decode(#[from] spts_eval::algorithm::DecodeError),
    /// Rows that are no pattern.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}
