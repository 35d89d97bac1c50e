//! Gains of a calibrated skin, read from the file that a scene or a data set's specification names.

use super::error::ChainError;
use super::stages::MAX_TOML_BYTES;
use spts_models::TaxelGains;
use std::path::Path;

/// Parameter of the transducer that may name a file.
const GAINS: &str = "gains";

/// Replaces the file name in `gains` of the transducer's `parameters` by the gains in that file. A relative name is
/// looked up in `folder`. A scene stored afterwards no longer needs the file.
///
/// # Errors
/// [`ChainError::Gains`] if the file cannot be read or holds no gains.
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
