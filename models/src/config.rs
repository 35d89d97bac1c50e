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

/// Checks that `value` is in [`least`, `most`], which `range` says in interval notation.
///
/// # Errors
/// [`ConfigError`] when `value` is outside the range, or NaN.
pub fn within(field: &str, value: f64, least: f64, most: f64, range: &'static str) -> Result<(), ConfigError> {
    in_range(field, value, (least..=most).contains(&value), range).map(drop)
}

/// `message` about a field, with the `section` that the field is in: "`section.field` = 3 is outside …", or "`section`:
/// …" for a message that does not begin with a field.
#[must_use]
pub fn in_section(section: &str, message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix('`') {
        Some(rest) if rest.contains("` = ") => format!("`{section}.{rest}"),
        _ => format!("`{section}`: {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_goes_before_its_field() {
        let error = in_range("bits", 40.0, false, "[1, 24]").unwrap_err().to_string();
        assert_eq!(in_section("adc", &error), "`adc.bits` = 40 is outside [1, 24]");
        assert_eq!(in_section("adc", "unknown field\nhere\n"), "`adc`: unknown field; here");
    }
}
