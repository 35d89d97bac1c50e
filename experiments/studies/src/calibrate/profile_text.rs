//! The fitted profile on top of the shipped one, checked as a scene checks it.

use super::profile::FittedReadout;
use spts::chain::DEFAULT_READOUT;
use spts_circuit::{PROFILES, Profile, ProfileError};

/// Fitted numbers that are not a profile.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FittedError {
    /// The shipped profile is not TOML.
    #[error("{DEFAULT_READOUT}: {0}")]
    Base(#[from] toml::de::Error),
    /// The profile cannot be written.
    #[error(transparent)]
    Text(#[from] toml::ser::Error),
    /// The readout refuses it.
    #[error(transparent)]
    Profile(#[from] ProfileError),
}

/// Profile of `readings` and its text, valid for a skin of `taxels` taxels. What they do not identify is kept from the
/// default readout.
///
/// # Errors
/// [`FittedError`] when the numbers are outside of what a readout takes.
pub fn fitted_profile(readings: &FittedReadout, taxels: u32) -> Result<(Profile, String), FittedError> {
    let base = PROFILES.iter().find(|(name, _)| *name == DEFAULT_READOUT);
    let base: toml::Table = toml::from_str(base.map_or("", |(_, text)| text))?;
    let text = readings.to_toml(&base)?;
    let profile = Profile::from_toml(&text)?;
    profile.validate(taxels)?;
    Ok((profile, text))
}
