//! Errors of a simulation.

use crate::chain::ChainError;
use crate::scene::SceneError;

/// Why the twin produced no recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The mechanics failed.
    #[error(transparent)]
    Sim(#[from] spts_input::Refusal),
    /// Transducer or readout failed, or the source of the weights cannot provide them.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// More values than are kept in memory at once.
    #[error("{what} = {values} is outside [1, {most}]")]
    TooLarge {
        /// Which quantity is too large.
        what: &'static str,
        /// Number of values.
        values: usize,
        /// Most values allowed.
        most: usize,
    },
}
