//! Why a row cannot be made.

use crate::spec::SpecError;
use spts::ChainError;
use spts_circuit::{AcquireError, SourceError};
use spts_contact::EquilibriumError;
#[cfg(feature = "mujoco")]
use spts_sim::SimError;

/// A row that cannot be made. It fails on any machine and at any try.
#[derive(Debug, thiserror::Error)]
#[error("row {index}: {cause}")]
pub struct RowError {
    /// Number of the row, from 0.
    pub index: u64,
    /// Why.
    pub cause: RowCause,
}

/// Why a row cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowCause {
    /// No pose of those that were tried is a balance.
    #[error("none of {attempts} poses is a balance; the last: {source}")]
    Balance {
        /// Poses that were drawn.
        attempts: u64,
        /// Why the last is none.
        source: EquilibriumError,
    },
    /// No pose of those that were tried can be followed in time.
    #[cfg(feature = "mujoco")]
    #[error("none of {attempts} poses can be pressed or fallen on; the last: {source}")]
    Motion {
        /// Poses that were drawn.
        attempts: u64,
        /// Why the last cannot.
        source: SimError,
    },
    /// It moves in time, and this build has no physics engine.
    #[cfg(not(feature = "mujoco"))]
    #[error(
        "`record.what` is not \"hold\", or the contact field does not balance: what moves in time needs MuJoCo, which is left out here"
    )]
    Engine,
    /// A value that was drawn is refused.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The skin or its readout is refused.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The readout refuses the conductance.
    #[error(transparent)]
    Acquire(#[from] AcquireError),
    /// The conductance is refused.
    #[error(transparent)]
    Source(#[from] SourceError),
}
