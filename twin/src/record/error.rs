//! What can stop a simulation.

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
    Sim(#[from] spts_sim::SimError),
    /// Transducer or readout failed, or the weights cannot come from where the scene says.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// More values than are kept at once.
    #[error("{what} = {values} is outside [1, {most}]")]
    TooLarge {
        /// What makes up the number.
        what: &'static str,
        /// Number of values.
        values: usize,
        /// Most values allowed.
        most: usize,
    },
}
