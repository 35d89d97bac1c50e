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
    /// Transducer or readout failed.
    #[error(transparent)]
    Chain(#[from] ChainError),
}
