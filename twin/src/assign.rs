//! `KEY=VALUE`: one field of a table, and the value to give it.

use spts_input::Refusal;
use std::fmt;
use std::str::FromStr;
use toml::{Table, Value};

/// One field of a scene or of another table, and the value to give it.
///
/// The key is a dotted path, such as `press.force_n`. A number selects an entry of a list, counted from 0
/// (`faults.0.taxel`); `+` appends an entry (`faults.+`). The value is TOML. A bare word is a string.
///
/// ```
/// use spts::assign::Assignment;
///
/// let mut table: toml::Table = toml::from_str("[press]\nobject = \"T\"")?;
/// for text in ["press.force_n=12", "readout=ideal", "faults.+={ name = \"dead\", taxel = 44 }"] {
///     text.parse::<Assignment>()?.put_into(&mut table)?;
/// }
/// assert_eq!(table["faults"][0]["taxel"].as_integer(), Some(44));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Alternative keys, of which the scene uses the one whose section (`[press]` or `[drop]`) it has.
    pub(crate) keys: Vec<String>,
    pub(crate) value: Value,
    /// How the user wrote it.
    said: String,
}

/// Most parts of a key: no field lies deeper.
const MOST_PARTS: usize = 16;

impl FromStr for Assignment {
    type Err = Refusal;

    fn from_str(text: &str) -> Result<Self, Refusal> {
        let refused = |reason: &str| Refusal::new(reason).at(text);
        let Some((key, value)) = text.split_once('=') else {
            return Err(refused("KEY=VALUE is needed, such as press.force_n=12"));
        };
        let (key, value) = (key.trim(), value.trim());
        if key.split('.').any(|part| part.trim().is_empty()) {
            return Err(refused("the key is a dotted path of names, such as press.force_n"));
        }
        let depth = key.split('.').count();
        if depth > MOST_PARTS {
            return Err(refused(&format!("the key has {depth} parts, outside [1, {MOST_PARTS}]")));
        }
        let value = match toml::from_str::<Table>(&format!("value = {value}")) {
            Ok(mut table) if table.len() == 1 => table.remove("value").unwrap_or(Value::Boolean(false)),
            _ if value.starts_with(['[', '{', '"', '\'']) || value.contains('\n') || value.is_empty() => {
                return Err(refused("the value is not TOML; a text with spaces or brackets needs quotes"));
            }
            _ => Value::String(value.to_owned()),
        };
        Ok(Self { keys: vec![key.to_owned()], value, said: text.to_owned() })
    }
}

impl fmt::Display for Assignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.said)
    }
}

impl Assignment {
    /// The assignment of `value` for the option `option` of a command. `keys` are alternatives: the one
    /// whose section the scene has is set.
    ///
    /// # Panics
    /// If `keys` is empty.
    pub fn of_option(option: &str, keys: &[&str], value: Value) -> Self {
        assert!(!keys.is_empty(), "an option stands for a key");
        let shown = match &value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        Self { keys: keys.iter().map(|&key| key.to_owned()).collect(), said: format!("{option} {shown}"), value }
    }

    /// Whether the assignment sets `key`.
    pub fn sets(&self, key: &str) -> bool {
        self.keys.iter().any(|k| k == key)
    }

    /// An error about this assignment.
    pub(crate) fn refused(&self, reason: impl Into<String>) -> Refusal {
        Refusal::new(reason).at(self)
    }

    /// Puts the value into `table`. `table` may be any table, and the result is not checked as a scene.
    ///
    /// # Errors
    /// [`Refusal`] if the key lies below a plain value, or names an entry that a list does not have.
    pub fn put_into(&self, table: &mut Table) -> Result<(), Refusal> {
        self.put(table, &self.keys[0])
    }

    pub(crate) fn put(&self, table: &mut Table, key: &str) -> Result<(), Refusal> {
        set(table, key, self.value.clone()).map_err(|reason| self.refused(reason))
    }
}

/// Puts `value` at the dotted path `key` of `table`.
fn set(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    let (first, rest) = match key.split_once('.') {
        None => {
            table.insert(key.trim().to_owned(), value);
            return Ok(());
        }
        Some((first, rest)) => (first.trim(), rest),
    };
    let entry = rest.split('.').next().unwrap_or(rest);
    let list = entry == "+" || entry.parse::<usize>().is_ok();
    let empty = if list { Value::Array(Vec::new()) } else { Value::Table(Table::new()) };
    match table.entry(first).or_insert(empty) {
        Value::Table(inner) => set(inner, rest, value),
        Value::Array(entries) => set_entry(entries, first, rest, value),
        _ => Err(format!("`{first}` has a value, and no fields of its own")),
    }
}

/// Puts `value` at the path `key` of the list called `name`, whose first part is the number of an entry.
fn set_entry(entries: &mut Vec<Value>, name: &str, key: &str, value: Value) -> Result<(), String> {
    let (number, rest) = key.split_once('.').map_or((key, None), |(n, rest)| (n, Some(rest)));
    if number == "+" {
        entries.push(Value::Table(Table::new()));
    }
    let last = entries.len().checked_sub(1);
    let index = if number == "+" { last } else { number.parse().ok() };
    let Some(entry) = index.and_then(|index| entries.get_mut(index)) else {
        let valid = last.map_or("none yet".to_owned(), |last| format!("0 to {last}"));
        return Err(format!(
            "`{name}` is a list: `{number}` is the number of none of its entries ({valid}); `{name}.+` adds one"
        ));
    };
    match (rest, entry) {
        (None, entry) => *entry = value,
        (Some(rest), Value::Table(inner)) => set(inner, rest, value)?,
        (Some(rest), _) => return Err(format!("`{name}.{number}` has no field `{rest}`")),
    }
    Ok(())
}
