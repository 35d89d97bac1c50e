//! Errors of the exploration.

use crate::electronics::ElectronicsError;

/// Why there is no [`ExploreReport`](super::ExploreReport).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExploreError {
    /// The electronics of as_designed cannot be used.
    #[error(transparent)]
    Electronics(#[from] ElectronicsError),
    /// The amplifier or the readout of a wire cannot be built, or the wire cannot be measured.
    #[error(transparent)]
    Refused(#[from] spts_input::Refusal),
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
    /// The cells' generator has no operator.
    #[error(transparent)]
    Generator(#[from] spts_recon::RangeError),
    /// The skin cannot be recovered from its measurements.
    #[error(transparent)]
    Recover(#[from] spts_recon::RecoverError),
}
