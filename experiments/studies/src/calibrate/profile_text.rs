//! Merges the fitted profile into the shipped one, and checks it like a scene's.

use super::profile::FittedReadout;
use spts::chain::DEFAULT_READOUT;
use spts_circuit::{PROFILES, Profile};

/// Why fitted values are not a valid profile.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FittedError {
    /// The shipped profile is not TOML.
    #[error("{DEFAULT_READOUT}: {0}")]
    Base(#[from] toml::de::Error),
    /// The profile cannot be written.
    #[error(transparent)]
    Text(#[from] toml::ser::Error),
    /// The readout refuses the profile.
    #[error(transparent)]
    Profile(#[from] spts_input::Refusal),
}

/// The profile of `readings` and its text, for a skin of `taxels` taxels. Undetermined parameters are taken from the
/// default readout.
///
/// # Errors
/// [`FittedError`] if a value is outside its range.
pub fn fitted_profile(readings: &FittedReadout, taxels: u32) -> Result<(Profile, String), FittedError> {
    let base = PROFILES.iter().find(|(name, _)| *name == DEFAULT_READOUT);
    let base: toml::Table = toml::from_str(base.map_or("", |(_, text)| text))?;
    let text = readings.to_toml(&base)?;
    let profile = Profile::from_toml(&text)?;
    profile.validate(taxels)?;
    Ok((profile, text))
}
