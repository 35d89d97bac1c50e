//! Explains errors of TOML values in the user's terms: field, value, and what is valid.

use crate::config::in_section;
use toml::de::Error;

/// The message for `error`, an error about a value in a table, such as "`press.force_n` = "much": a number is needed".
///
/// ```
/// use spts_models::explain_toml;
///
/// let table: toml::Table = toml::from_str("rows = -1")?;
/// let error = table.try_into::<spts_models::SkinLayout>().unwrap_err();
/// assert_eq!(explain_toml(&error), "`rows` = -1: a whole number from 0 on is needed");
/// # Ok::<(), toml::de::Error>(())
/// ```
#[must_use]
pub fn explain_toml(error: &Error) -> String {
    let shown = error.to_string();
    let key = shown
        .rsplit_once("in `")
        .and_then(|(_, rest)| rest.trim_end().strip_suffix('`'));
    let message = error.message().trim_end();
    match (key, mistake(message)) {
        (Some(key), Some((found, needed))) => format!("`{key}` = {found}: {needed} is needed"),
        (None, Some((found, needed))) => format!("{needed} is needed, found {found}"),
        (Some(key), None) => in_section(key, message),
        (None, None) => message.replace('\n', "; "),
    }
}

/// What was found and what is needed, of a message about a value of the wrong type.
fn mistake(message: &str) -> Option<(String, String)> {
    let rest = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|start| message.strip_prefix(start))?;
    let (found, expected) = rest.split_once(", expected ")?;
    Some((in_toml(found), in_words(expected)))
}

/// What was found, as it is written in TOML.
fn in_toml(found: &str) -> String {
    match found {
        "map" => return "a table".to_owned(),
        "sequence" => return "a list".to_owned(),
        _ => {}
    }
    if let Some(text) = found.strip_prefix("string ") {
        return text.to_owned();
    }
    let value = found.split_once('`').and_then(|(_, rest)| rest.strip_suffix('`'));
    match value {
        Some(value) => value.to_owned(),
        None if found.chars().all(|c| c.is_ascii_digit()) => format!("a list of {found}"),
        None => found.to_owned(),
    }
}

/// What is needed, without the names of types.
fn in_words(expected: &str) -> String {
    let words = match expected {
        "f64" | "f32" => "a number",
        "u64" | "usize" => "a whole number from 0 on",
        "u32" => "a whole number in [0, 2^32)",
        "u16" => "a whole number in [0, 65535]",
        "u8" => "a whole number in [0, 255]",
        "i64" => "a whole number",
        "a boolean" => "true or false",
        "a string" => "a text in quotes",
        "a sequence" => "a list",
        "a map" => "a table",
        other if other.starts_with("struct ") => "a table",
        other => match other.strip_prefix("an array of length ") {
            Some(length) => return format!("a list of {length}"),
            None => other,
        },
    };
    words.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    struct Fields {
        share: f64,
        name: String,
        on: bool,
        pair: [f64; 2],
        list: Vec<u8>,
        inner: Inner,
    }

    impl Default for Fields {
        fn default() -> Self {
            Self {
                share: 0.0,
                name: String::new(),
                on: false,
                pair: [0.0; 2],
                list: Vec::new(),
                inner: Inner::default(),
            }
        }
    }

    #[derive(Debug, Default, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    struct Inner {
        count: u32,
    }

    #[test]
    fn field_value_and_what_is_needed() {
        for (text, said) in [
            ("share = \"much\"", "`share` = \"much\": a number is needed"),
            ("share = {}", "`share` = a table: a number is needed"),
            ("name = 3", "`name` = 3: a text in quotes is needed"),
            ("on = 1", "`on` = 1: true or false is needed"),
            ("list = 3", "`list` = 3: a list is needed"),
            ("list = [300]", "`list` = 300: a whole number in [0, 255] is needed"),
            ("inner = 1", "`inner` = 1: a table is needed"),
            (
                "inner.count = -1",
                "`inner.count` = -1: a whole number in [0, 2^32) is needed",
            ),
            (
                "inner.count = 1.5",
                "`inner.count` = 1.5: a whole number in [0, 2^32) is needed",
            ),
            ("pair = [1.0]", "`pair` = a list of 1: a list of 2 is needed"),
            ("inner.cuont = 1", "unknown field `cuont`, expected `count`"),
        ] {
            let table: toml::Table = toml::from_str(text).unwrap();
            let error = table.try_into::<Fields>().unwrap_err();
            let found = explain_toml(&error);
            assert!(found.contains(said), "{text}: {found}");
        }
    }
}
