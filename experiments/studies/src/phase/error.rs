//! Errors of the phase study.

use spts_recon::recover::ParameterError;

/// Why there is no [`PhaseReport`](super::PhaseReport).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhaseError {
    /// The theory is not defined for this undersampling.
    #[error(transparent)]
    Theory(#[from] ParameterError),
    /// A method cannot be built.
    #[error("{name}: {reason}")]
    Method {
        /// Name of the method.
        name: &'static str,
        /// Message of the method.
        reason: String,
    },
}
