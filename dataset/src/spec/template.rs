//! A table of parameters whose numbers may be draws.

use super::draw::Draw;
use super::error::SpecError;
use spts_models::{Streams, in_section};
use toml::{Table, Value};

/// Names of the distributions: a table with one of these keys alone is a draw.
const DISTRIBUTIONS: [&str; 5] = ["uniform", "log_uniform", "normal", "choice", "grid"];

/// Parameters that go to others, such as a transducer's, with their draws.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Template {
    table: Table,
}

impl Template {
    pub(crate) fn new(table: Table) -> Self {
        Self { table }
    }

    /// The table of item `index`, every draw replaced by its number. `section` names the table.
    ///
    /// # Errors
    /// [`SpecError::Choice`] for a draw that is none.
    pub(crate) fn of(&self, streams: Streams, section: &str, index: u64) -> Result<Table, SpecError> {
        let mut turn = 1;
        filled(&self.table, section, &mut |mut draw, field| {
            draw.take_turn(&mut turn);
            draw.value(streams, field, index)
        })
    }

    /// The table with every draw at its least number, and with every draw at its largest.
    ///
    /// # Errors
    /// As for [`Template::of`].
    pub(crate) fn ends(&self, section: &str) -> Result<[Table; 2], SpecError> {
        let end = |k: usize| filled(&self.table, section, &mut |draw, _| draw.range()[k]);
        Ok([end(0)?, end(1)?])
    }
}

/// `table` with the numbers that `number` gives for its draws and their fields.
fn filled(table: &Table, section: &str, number: &mut dyn FnMut(Draw, &str) -> f64) -> Result<Table, SpecError> {
    let mut out = Table::new();
    for (key, value) in table {
        let field = format!("{section}.{key}");
        let value = match value {
            Value::Table(inner) if is_draw(inner) => {
                let draw = Draw::from_toml(value);
                let draw = draw.map_err(|problem| SpecError::Choice(in_section(&field, &problem)))?;
                Value::Float(number(draw, &field))
            }
            Value::Table(inner) => Value::Table(filled(inner, &field, number)?),
            other => other.clone(),
        };
        out.insert(key.clone(), value);
    }
    Ok(out)
}

/// Whether `table` writes a distribution.
pub(super) fn is_draw(table: &Table) -> bool {
    table.len() == 1 && table.keys().all(|key| DISTRIBUTIONS.contains(&key.as_str()))
}
