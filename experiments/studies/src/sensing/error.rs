//! Errors of row design.

use spts::data::DataError;
use spts_circuit::WeightsError;
use spts_eval::training::LearnError;
use spts_recon::recover::PriorError;
use spts_recon::rows::RowError;

/// Why no rows can be designed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SensingError {
    /// The designer has no such rows.
    #[error(transparent)]
    Rows(#[from] RowError),
    /// Recordings that cannot be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// There is no training data.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// Images from which no prior can be made.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// Touches that cannot be pressed or measured.
    #[error(transparent)]
    Touch(#[from] crate::touches::TouchError),
    /// There is no such readout.
    #[error(transparent)]
    Profile(#[from] spts_circuit::ProfileError),
    /// Windows that cannot be decoded.
    #[error(transparent)]
    Decode(#[from] spts_eval::algorithm::DecodeError),
    /// Rows that are not a valid pattern.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}
