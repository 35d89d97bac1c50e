//! One error for every parameter outside its range.

/// A configuration value outside its valid range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{field}` = {value} is outside {range}")]
pub struct ConfigError {
    /// Name of the field, as it is written in a scene file.
    pub field: String,
    /// Offending value.
    pub value: f64,
    /// Valid range, in interval notation.
    pub range: &'static str,
}

/// Returns `value` when `ok` holds, and otherwise an error that names the field. Write `ok` as a comparison that
/// NaN fails.
///
/// # Errors
/// [`ConfigError`] when `ok` is false.
pub fn in_range(field: &str, value: f64, ok: bool, range: &'static str) -> Result<f64, ConfigError> {
    if ok {
        Ok(value)
    } else {
        Err(ConfigError {
            field: field.to_owned(),
            value,
            range,
        })
    }
}
