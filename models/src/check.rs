//! Checks of values against their ranges, and errors of TOML in the user's terms: field, value, and what is valid.

use serde::de::DeserializeOwned;
use spts_input::{Refusal, Tables};
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error, ValueDeserializer};

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
/// [`Refusal`] if `ok` is false.
pub fn in_range(field: &str, value: f64, ok: bool, range: &'static str) -> Result<f64, Refusal> {
    ok.then_some(value).ok_or_else(|| Refusal::range(field, Shown(value), range))
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
/// [`Refusal`] if `value` is outside the range, or NaN.
pub fn within(field: &str, value: f64, least: f64, most: f64, range: &'static str) -> Result<(), Refusal> {
    in_range(field, value, (least..=most).contains(&value), range).map(drop)
}

/// Checks that `value` lies in `interval`, written as in an error: "[0.5, 100] N", "(0, 1]" or "(0, ∞)".
///
/// ```
/// use spts_models::in_interval;
///
/// assert!(in_interval("press.force_n", 20.0, "[0.5, 100] N").is_ok());
/// let error = in_interval("press.scale", 0.0, "(0, 1000]").unwrap_err();
/// assert_eq!(error.to_string(), "`press.scale` = 0 is outside (0, 1000]");
/// ```
///
/// # Errors
/// [`Refusal`] if `value` is outside the interval, or NaN.
pub fn in_interval(field: &str, value: f64, interval: &'static str) -> Result<(), Refusal> {
    in_range(field, value, holds(interval, value) == Some(true), interval).map(drop)
}

/// Whether `interval` holds `value`; `None` for a text that is no interval.
fn holds(interval: &str, value: f64) -> Option<bool> {
    let number = |text: &str| {
        if text == "∞" { Some(f64::INFINITY) } else { text.parse().ok() }
    };
    let (low, rest) = interval.get(1..)?.split_once(", ")?;
    let (high, _) = rest.split_once([')', ']'])?;
    let closed = rest[high.len()..].starts_with(']');
    let (low, high): (f64, f64) = (number(low)?, number(high)?);
    let above = if interval.starts_with('[') { value >= low } else { value > low };
    Some(above && if closed { value <= high } else { value < high })
}

/// Checks that so many bytes of memory are free for `what`, such as "a prior of 65,536 × 65,536 taxels". Where the
/// system does not say how much is free, nothing is checked.
///
/// ```
/// use spts_models::fits_memory;
///
/// assert!(fits_memory("an image", 800.0).is_ok());
/// let error = fits_memory("a prior of 1e8 taxels", 1e17).map_err(|e| e.to_string());
/// # if cfg!(target_os = "linux") {
/// assert!(error.unwrap_err().starts_with("a prior of 1e8 taxels takes 100000000.0 GB of memory, and"));
/// # }
/// ```
///
/// # Errors
/// [`Refusal`] with both sizes if there is less.
pub fn fits_memory(what: &str, bytes: f64) -> Result<(), Refusal> {
    let said = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = said.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    let Some(free) = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()) else {
        return Ok(());
    };
    let free = 1024.0 * free;
    if bytes <= free {
        return Ok(());
    }
    Err(Refusal::new(format!("{what} takes {:.1} GB of memory, and {:.1} GB are free", 1e-9 * bytes, 1e-9 * free)))
}

/// Names the section of a TOML file in an error about one of its keys. `message` is the error as the section's reader
/// gives it; the result is one line.
///
/// - A message that begins with a key and its value, "`bits` = 40 is outside [1, 24]", becomes "`adc.bits` = 40 is
///   outside [1, 24]" for the `section` "adc".
/// - Any other message, such as "unknown field", becomes "`adc`: unknown field".
pub fn in_section(section: &str, message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix('`') {
        Some(rest) if names_a_field(rest) => format!("`{section}.{rest}"),
        _ => format!("`{section}`: {message}"),
    }
}

/// Whether `rest`, the message after its first backtick, goes on with a value of the field between the backticks.
fn names_a_field(rest: &str) -> bool {
    rest.split_once('`').is_some_and(|(_, after)| after.starts_with(" = ") || after.starts_with(": "))
}

/// The value that `table` describes.
///
/// # Errors
/// [`Refusal`] for an unknown key or a value of the wrong type, with the field, its value and what is needed.
pub fn parsed<T: DeserializeOwned>(table: toml::Table) -> Result<T, Refusal> {
    // read as text is, so that every type has one reader, which is most of its code
    let text = table.to_string();
    let table = DeTable::parse(&text).and_then(deserialized);
    table.map_err(|error| Refusal::new(explained(&error)))
}

/// The value that the TOML text `text` describes.
///
/// ```
/// use spts_models::{SkinLayout, parsed_text};
///
/// let error = parsed_text::<SkinLayout>("cols = 10\nrows = -1").unwrap_err();
/// assert_eq!(error.to_string(), "line 2: `rows` = -1: a whole number from 0 on is needed (`rows = -1`)");
/// ```
///
/// # Errors
/// The same, with the line.
pub fn parsed_text<T: DeserializeOwned>(text: &str) -> Result<T, Refusal> {
    let table = DeTable::parse(text).map_err(|error| placed(text, &error, true))?;
    deserialized(table).map_err(|error| {
        let span = error.span().unwrap_or_default();
        // what is missing has no place
        placed(text, &error, !span.is_empty() && span.len() < text.trim_end().len())
    })
}

/// The value that a table of a text describes.
fn deserialized<T: DeserializeOwned>(table: Spanned<DeTable<'_>>) -> Result<T, Error> {
    let span = table.span();
    let table = Spanned::new(span, DeValue::Table(table.into_inner()));
    T::deserialize(Tables(ValueDeserializer::from(table)))
}

/// `error` in `text`, with its line if it `has_place`.
fn placed(text: &str, error: &Error, has_place: bool) -> Refusal {
    let message = explained(error);
    if !has_place {
        return Refusal::new(message);
    }
    let start = error.span().unwrap_or_default().start.min(text.len());
    let line = text.get(..start).unwrap_or_default().matches('\n').count();
    let shown = text.lines().nth(line).unwrap_or_default().trim();
    let shown: String = shown.chars().take(SHOWN).collect();
    Refusal::new(format!("line {}: {message} (`{shown}`)", line + 1))
}

/// Characters of a wrong line that an error repeats: a line of any file of ours is shorter.
const SHOWN: usize = 120;

/// The message for `error`, an error about a value in a table, such as "`press.force_n` = "much": a number is needed".
fn explained(error: &Error) -> String {
    let shown = error.to_string();
    let key = shown.rsplit_once("in `").and_then(|(_, rest)| rest.trim_end().strip_suffix('`'));
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
    if message == "wanted string or table" {
        return Some(("another value".to_owned(), "a text in quotes".to_owned()));
    }
    let rest = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|start| message.strip_prefix(start))?;
    let (found, expected) = rest.split_once(", expected ")?;
    Some((in_toml(found), in_words(expected)))
}

/// What was found, as it is written in TOML.
fn in_toml(found: &str) -> String {
    match found {
        // to the reader a date is a table, too
        "map" => return "a table or a date".to_owned(),
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

    #[test]
    fn a_section_goes_before_its_field() {
        let error = in_range("bits", 40.0, false, "[1, 24]").unwrap_err().to_string();
        assert_eq!(in_section("adc", &error), "`adc.bits` = 40 is outside [1, 24]");
        let huge = in_range("pitch_m", -1e308, false, "[0, 1]").unwrap_err().to_string();
        assert_eq!(huge, "`pitch_m` = -1e308 is outside [0, 1]");
        let message = "`inner.count` = 1.5: a whole number is needed";
        assert_eq!(in_section("adc", message), "`adc.inner.count` = 1.5: a whole number is needed");
        assert_eq!(in_section("adc", "unknown field\nhere\n"), "`adc`: unknown field; here");
    }

    #[test]
    fn an_interval_is_what_its_text_says() {
        for (interval, inside, outside) in [
            ("[1e-3, 4] kg", [1e-3, 4.0], [0.999e-3, 4.001]),
            ("(-1, 1)", [-0.999, 0.999], [-1.0, 1.0]),
            ("(0, ∞)", [1e-300, 1e300], [0.0, f64::INFINITY]),
            ("[-5, 5]", [-5.0, 5.0], [f64::NAN, f64::NEG_INFINITY]),
        ] {
            assert!(inside.iter().all(|v| in_interval("x", *v, interval).is_ok()), "{interval}");
            assert!(outside.iter().all(|v| in_interval("x", *v, interval).is_err()), "{interval}");
        }
    }

    #[derive(Debug, Default, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    struct Fields {
        share: f64,
        name: String,
        on: bool,
        pair: [f64; 2],
        list: Vec<u8>,
        inner: Inner,
        kind: Kind,
    }

    #[derive(Debug, Default, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        #[default]
        Plain,
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
            ("share = {}", "`share` = a table or a date: a number is needed"),
            ("share = 2026-11-30", "`share` = a table or a date: a number is needed"),
            ("name = 3", "`name` = 3: a text in quotes is needed"),
            ("on = 1", "`on` = 1: true or false is needed"),
            ("list = 3", "`list` = 3: a list is needed"),
            ("list = [300]", "`list` = 300: a whole number in [0, 255] is needed"),
            ("inner = 1", "`inner` = 1: a table is needed"),
            ("inner.count = -1", "`inner.count` = -1: a whole number in [0, 2^32) is needed"),
            ("inner.count = 1.5", "`inner.count` = 1.5: a whole number in [0, 2^32) is needed"),
            ("pair = [1.0]", "`pair` = a list of 1: a list of 2 is needed"),
            ("pair = [1.0, 2.0, 3.0]", "`pair` = a list of 3: a list of 2 is needed"),
            ("kind = 3", "`kind` = another value: a text in quotes is needed"),
            ("inner.cuont = 1", "unknown field `cuont`, expected `count`"),
        ] {
            let table: toml::Table = toml::from_str(text).unwrap();
            let found = [parsed::<Fields>(table), parsed_text(text)].map(|read| read.unwrap_err().to_string());
            assert!(found.iter().all(|found| found.contains(said)), "{text}: {found:?}");
        }
    }
}
