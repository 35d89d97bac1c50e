//! Why the phase plane cannot be measured.

use spts_recon::recover::ParameterError;

/// Why there is no [`PhaseReport`](super::PhaseReport).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhaseError {
    /// The theory says nothing for this undersampling.
    #[error(transparent)]
    Theory(#[from] ParameterError),
    /// A method cannot be built.
    #[error("{name}: {reason}")]
    Method {
        /// Name of the method.
        name: &'static str,
        /// What the method says.
        reason: String,
    },
}
