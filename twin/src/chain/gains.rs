//! Gains of a calibrated skin, from the file that a scene or a spec names.

use super::error::ChainError;
use super::stages::MAX_TOML_BYTES;
use spts_models::TaxelGains;
use std::path::Path;

/// Parameter of the transducer that may name a file.
const GAINS: &str = "gains";

/// Puts the gains in the file that `gains` of the transducer's `parameters` names, in `folder`, in place of its name:
/// what is stored then needs no file.
///
/// # Errors
/// [`ChainError::Gains`] when there is no such file, or it has no gains.
pub fn read_gains(parameters: &mut toml::Table, folder: &Path) -> Result<(), ChainError> {
    let Some(toml::Value::String(name)) = parameters.get(GAINS) else {
        return Ok(());
    };
    let path = folder.join(name);
    let refused = |reason: String| ChainError::Gains {
        path: path.clone(),
        reason,
    };
    let text = spts_input::read_text(&path, MAX_TOML_BYTES).map_err(|error| refused(error.to_string()))?;
    let gains = TaxelGains::from_toml(&text).map_err(&refused)?;
    let value = toml::Value::try_from(&gains).map_err(|error| refused(error.to_string()))?;
    parameters.insert(GAINS.to_owned(), value);
    Ok(())
}
