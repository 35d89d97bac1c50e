//! Errors of rows.

use crate::spec::SpecError;
use spts_contact::EquilibriumError;
use spts_input::Refusal;

/// Why a row cannot be made. The error is the same on any machine and at every attempt.
#[derive(Debug, thiserror::Error)]
#[error("row {index}: {cause}")]
pub struct RowError {
    /// Number of the row, from 0.
    pub index: u64,
    /// Why.
    pub cause: RowCause,
}

/// Cause of a [`RowError`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowCause {
    /// None of the poses tried has an equilibrium.
    #[error("none of {attempts} poses has an equilibrium; the last: {source}")]
    Balance {
        /// Number of poses tried.
        attempts: u64,
        /// The error of the last pose.
        source: EquilibriumError,
    },
    /// None of the poses tried can be simulated in time.
    #[cfg(feature = "mujoco")]
    #[error("none of {attempts} poses can be pressed or dropped; the last: {source}")]
    Motion {
        /// Number of poses tried.
        attempts: u64,
        /// The error of the last pose.
        source: Refusal,
    },
    /// The row needs a simulation in time, and this build has no physics engine.
    #[cfg(not(feature = "mujoco"))]
    #[error(
        "`record.what` is not \"hold\", or the contact field does not balance: motion in time needs MuJoCo, which this build lacks"
    )]
    Engine,
    /// A drawn value that is not valid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// Skin, readout or conductance is not valid, or the readout refuses the conductance.
    #[error(transparent)]
    Refused(#[from] Refusal),
}
