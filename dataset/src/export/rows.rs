//! The rows of a data set, one at a time, for exports.

use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::read::{Wanted, batches, json, numbers};
use crate::shard::schema;
use arrow_array::cast::AsArray as _;
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use serde_json::Value;
use spts::progress::Progress;
use std::path::Path;

/// One row of a file.
pub(super) struct RowView<'a> {
    batch: &'a RecordBatch,
    row: usize,
    path: &'a Path,
}

/// Calls `each` with the rows of `split`, in the order of their numbers, and counts a step of `progress` for each.
pub(super) fn each_row(
    dataset: &Dataset,
    split: &'static str,
    progress: &dyn Progress,
    mut each: impl FnMut(&RowView<'_>) -> Result<(), DatasetError>,
) -> Result<(), DatasetError> {
    let needed = schema(dataset.spec());
    for shard in 0..dataset.spec().shards() {
        let path = dataset.shard_file(shard);
        batches(&path, Wanted::Split(split), |batch| {
            // the footer says whose rows they are; a file of other columns was made by hand
            let found = batch.schema();
            let is_alike = found.fields().len() == needed.fields().len()
                && (found.fields().iter().zip(needed.fields()))
                    .all(|(a, b)| a.name() == b.name() && a.data_type() == b.data_type());
            if !is_alike {
                return Err(DatasetError::file(&path, "has other columns than its spec says"));
            }
            for row in 0..batch.num_rows() {
                let path = &path;
                each(&RowView { batch, row, path })?;
                progress.step();
            }
            Ok(true)
        })?;
    }
    Ok(())
}

impl<'a> RowView<'a> {
    /// The file that the row is in.
    pub(super) fn path(&self) -> &'a Path {
        self.path
    }

    fn column(&self, name: &str) -> Result<&'a ArrayRef, DatasetError> {
        let column = self.batch.column_by_name(name);
        let column = column.filter(|array| !array.is_null(self.row));
        column.ok_or_else(|| self.problem(name, "has no value"))
    }

    fn problem(&self, name: &str, problem: &str) -> DatasetError {
        DatasetError::file(self.path, format!("column `{name}` {problem}"))
    }

    /// Text of the column `name`.
    pub(super) fn text(&self, name: &str) -> Result<&'a str, DatasetError> {
        let texts = self.column(name)?.as_string_opt::<i32>();
        let texts = texts.ok_or_else(|| self.problem(name, "is not of texts"))?;
        Ok(texts.value(self.row))
    }

    /// The only number of the column `name`.
    pub(super) fn number(&self, name: &str) -> Result<f64, DatasetError> {
        let mut values = Vec::with_capacity(1);
        self.numbers(name, &mut values)?;
        match values[..] {
            [value] => Ok(value),
            _ => Err(self.problem(name, "is not of single numbers")),
        }
    }

    /// Adds the numbers of the column `name` to `out`: finite, and exact, since a whole number below 2^53 is a double.
    pub(super) fn numbers(&self, name: &str, out: &mut Vec<f64>) -> Result<(), DatasetError> {
        let mut finite = true;
        numbers(&self.values(name)?, |value| {
            finite &= value.is_finite();
            out.push(value);
        });
        if finite {
            Ok(())
        } else {
            Err(self.problem(name, "holds a value that is not finite"))
        }
    }

    /// The values of the column `name`: of a list its entries, else the one value.
    pub(super) fn values(&self, name: &str) -> Result<ArrayRef, DatasetError> {
        let column = self.column(name)?;
        Ok(match column.as_fixed_size_list_opt() {
            Some(list) => list.value(self.row),
            None => column.slice(self.row, 1),
        })
    }

    /// The column `name` as JSON; null without a value.
    pub(super) fn json(&self, name: &str) -> Value {
        self.batch
            .column_by_name(name)
            .map_or(Value::Null, |column| json(column, self.row))
    }
}
