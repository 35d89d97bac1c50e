//! The error for a parameter outside its range.

/// A configuration value outside its valid range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{field}` = {} is outside {range}", Shown(*value))]
pub struct ConfigError {
    /// Name of the parameter: its key in a scene file, such as `press.force_n`.
    pub field: String,
    /// The value.
    pub value: f64,
    /// Valid range, in interval notation.
    pub range: &'static str,
}

/// A number as a person would write it: without hundreds of zeros.
struct Shown(f64);

impl std::fmt::Display for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(value) = self;
        let size = value.abs();
        if size.is_finite() && size > 0.0 && !(1e-5..1e15).contains(&size) {
            write!(f, "{value:e}")
        } else {
            write!(f, "{value}")
        }
    }
}

/// Returns `value` if `ok` holds, and otherwise an error that names `field`, the parameter's key in a scene file. Write
/// `ok` as a comparison that fails for NaN.
///
/// # Errors
/// [`ConfigError`] if `ok` is false.
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

/// Checks that `value` lies in [`least`, `most`]. `range` is the same interval as text.
///
/// ```
/// use spts_models::within;
///
/// assert!(within("press.force_n", 20.0, 0.5, 100.0, "[0.5, 100]").is_ok());
/// let error = within("press.force_n", f64::NAN, 0.5, 100.0, "[0.5, 100]").unwrap_err();
/// assert_eq!(error.to_string(), "`press.force_n` = NaN is outside [0.5, 100]");
/// ```
///
/// # Errors
/// [`ConfigError`] if `value` is outside the range, or NaN.
pub fn within(field: &str, value: f64, least: f64, most: f64, range: &'static str) -> Result<(), ConfigError> {
    in_range(field, value, (least..=most).contains(&value), range).map(drop)
}

/// Names the section of a TOML file in an error about one of its keys. `message` is the error as the section's reader
/// gives it; the result is one line.
///
/// - A message that begins with a key and its value, "`bits` = 40 is outside [1, 24]", becomes "`adc.bits` = 40 is
///   outside [1, 24]" for the `section` "adc".
/// - Any other message, such as "unknown field", becomes "`adc`: unknown field".
#[must_use]
pub fn in_section(section: &str, message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix('`') {
        Some(rest) if names_a_field(rest) => format!("`{section}.{rest}"),
        _ => format!("`{section}`: {message}"),
    }
}

/// Whether `rest`, the message after its first backtick, goes on with a value of the field between the backticks.
fn names_a_field(rest: &str) -> bool {
    rest.split_once('`')
        .is_some_and(|(_, after)| after.starts_with(" = ") || after.starts_with(": "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_goes_before_its_field() {
        let error = in_range("bits", 40.0, false, "[1, 24]").unwrap_err().to_string();
        assert_eq!(in_section("adc", &error), "`adc.bits` = 40 is outside [1, 24]");
        let huge = in_range("pitch_m", -1e308, false, "[0, 1]").unwrap_err().to_string();
        assert_eq!(huge, "`pitch_m` = -1e308 is outside [0, 1]");
        let message = "`inner.count` = 1.5: a whole number is needed";
        assert_eq!(
            in_section("adc", message),
            "`adc.inner.count` = 1.5: a whole number is needed"
        );
        assert_eq!(in_section("adc", "unknown field\nhere\n"), "`adc`: unknown field; here");
    }
}
