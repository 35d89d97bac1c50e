//! Errors of the exploration.

use spts_input::Refusal;

/// Why there is no [`ExploreReport`](super::ExploreReport).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExploreError {
    /// The electronics of as_designed cannot be used.
    #[error(transparent)]
    Electronics(#[from] Refusal),
    /// The amplifier of a wire cannot be built.
    #[error(transparent)]
    Amplifier(#[from] spts_models::ConfigError),
    /// The readout of a wire cannot be built.
    #[error(transparent)]
    Profile(#[from] spts_circuit::ProfileError),
    /// A profile lacks an effect, or the effect lacks a value.
    #[error("profile {profile}: no `compressive.{name}`")]
    NoEffect {
        /// Profile.
        profile: &'static str,
        /// Name of the effect, and of the value.
        name: &'static str,
    },
    /// There are more taxels on a wire than seeds.
    #[error("taxels of a wire: {0}")]
    Cells(#[from] std::num::TryFromIntError),
    /// The conductance of the taxels is not valid.
    #[error(transparent)]
    Source(#[from] spts_circuit::SourceError),
    /// A wire cannot be measured.
    #[error(transparent)]
    Acquire(#[from] spts_circuit::AcquireError),
    /// The cells' generator has no operator.
    #[error(transparent)]
    Generator(#[from] spts_recon::RangeError),
    /// The skin cannot be recovered from its measurements.
    #[error(transparent)]
    Recover(#[from] spts_recon::RecoverError),
}
