//! Merges the fitted profile into the shipped one, and checks it like a scene's.

use super::profile::FittedReadout;
use spts::chain::DEFAULT_READOUT;
use spts_circuit::{PROFILES, Profile};
use spts_input::Refusal;

/// The profile of `readings` and its text, for a skin of `taxels` taxels. Undetermined parameters are taken from the
/// default readout.
///
/// # Errors
/// [`Refusal`] if a value is outside its range.
pub fn fitted_profile(readings: &FittedReadout, taxels: u32) -> Result<(Profile, String), Refusal> {
    let base = PROFILES.iter().find(|(name, _)| *name == DEFAULT_READOUT);
    let base: toml::Table =
        toml::from_str(base.map_or("", |(_, text)| text)).map_err(|e| Refusal::from_error(e).at(DEFAULT_READOUT))?;
    let text = readings.to_toml(&base).map_err(Refusal::from_error)?;
    let profile = Profile::from_toml(&text).map_err(Refusal::from_error)?;
    profile.validate(taxels).map_err(Refusal::from_error)?;
    Ok((profile, text))
}
