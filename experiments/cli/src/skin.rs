//! Files of a skin's gains, as `spts calibrate --skin` writes them.

use crate::error::CliError;
use spts::chain::MAX_TOML_BYTES;
use spts_models::{SkinLayout, TaxelGains};
use std::path::Path;

/// The gains in the file `path`, of a skin of this `layout`.
///
/// # Errors
/// [`CliError`] with the file and what is wrong with it.
pub(crate) fn skin_gains(path: &Path, layout: &SkinLayout) -> Result<TaxelGains, CliError> {
    let failed = |reason: String| CliError::usage(format!("{}: {reason}", path.display()));
    let text = spts_input::read_text(path, MAX_TOML_BYTES).map_err(|error| failed(error.to_string()))?;
    let gains = TaxelGains::from_toml(&text).map_err(&failed)?;
    gains.check_skin(layout).map_err(|error| failed(error.to_string()))?;
    Ok(gains)
}
