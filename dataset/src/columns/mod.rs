//! The columns of a data set; the tables in the modules below have one line a column.

mod object;
mod row;

use crate::make::Row;
use crate::spec::Spec;
use crate::store::{Kind, Store};
use object::{OBJECT_COLUMNS, ObjectColumn};
use row::ROW_COLUMNS;
use serde::Serialize;

/// A column of a data set, as `spts dataset schema` shows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Type of a value.
    pub kind: Kind,
    /// Length of the list in each row; `None` for a single value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<usize>,
    /// Unit; empty without one.
    pub unit: &'static str,
    /// What the column contains.
    pub description: &'static str,
}

impl Column {
    /// Type as text, such as `float32[100]`.
    #[must_use]
    pub fn type_name(&self) -> String {
        let name = match self.kind {
            Kind::Text => "text",
            Kind::Bool => "bool",
            Kind::I32 => "int32",
            Kind::I64 => "int64",
            Kind::F32 => "float32",
        };
        self.length
            .map_or_else(|| name.to_owned(), |length| format!("{name}[{length}]"))
    }
}

/// The columns of the data set of `spec`, in order.
///
/// ```
/// use spts_dataset::{Spec, columns};
///
/// let columns = columns(&Spec::load("random-shapes", &toml::Table::new())?);
/// let pressure = columns.iter().find(|column| column.name == "pressure_pa").expect("a label");
/// assert_eq!((pressure.type_name().as_str(), pressure.unit), ("float32[100]", "Pa"));
/// # Ok::<(), spts_dataset::SpecError>(())
/// ```
#[must_use]
pub fn columns(spec: &Spec) -> Vec<Column> {
    let rows = ROW_COLUMNS.iter().filter(|(.., has, _)| has(spec));
    let rows = rows.map(|(name, kind, length, unit, description, ..)| Column {
        name: (*name).to_owned(),
        kind: *kind,
        length: length.map(|length| length(spec)),
        unit,
        description,
    });
    let objects = slots(spec).map(|(slot, (name, kind, unit, description, ..))| Column {
        name: if slot == 0 {
            (*name).to_owned()
        } else {
            format!("{name}_{}", slot + 1)
        },
        kind: *kind,
        length: None,
        unit,
        description,
    });
    rows.chain(objects).collect()
}

/// Empty stores of all columns, in the order of [`columns`].
pub(crate) fn stores(spec: &Spec) -> Vec<Store> {
    let all = columns(spec).into_iter();
    all.map(|column| Store::new(column.kind, column.length)).collect()
}

/// Adds `row` to the stores of all columns, which are in the order of [`columns`].
pub(crate) fn put(row: &Row<'_>, stores: &mut [Store]) {
    let mut stores = stores.iter_mut();
    let spec = row.spec();
    for ((.., fill), store) in ROW_COLUMNS.iter().filter(|(.., has, _)| has(spec)).zip(&mut stores) {
        fill(row, store);
    }
    for ((slot, (.., fill)), store) in slots(spec).zip(&mut stores) {
        match row.object(slot) {
            Some(object) => fill(&object, store),
            None => store.null(),
        }
    }
}

/// The columns of every object, object by object.
fn slots(spec: &Spec) -> impl Iterator<Item = (usize, &'static ObjectColumn)> {
    let has = |column: &&'static ObjectColumn| (column.4)(spec);
    (0..spec.most_objects()).flat_map(move |slot| OBJECT_COLUMNS.iter().filter(has).map(move |column| (slot, column)))
}
