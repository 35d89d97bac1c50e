//! Rows of a data set as JSON: out of its files, or made from its spec.

use crate::columns::{put, stores};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::make::Maker;
use crate::shard::{check_shard, schema, shard_rows};
use crate::spec::{Spec, SpecConfig};
use crate::store::Store;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use arrow_schema::{ArrowError, DataType, Schema};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReaderBuilder, RowSelection};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;

/// Rows that are read together.
const BATCH_ROWS: usize = 256;

/// What is read of a file.
struct Choice<'a> {
    /// Its rows, counted from its first one, in rising order.
    rows: Vec<usize>,
    /// Names of its columns; all when none is named.
    columns: &'a [&'a str],
}

/// Calls `each` with the rows of the file `path`, some at a time, until it says that it has had enough.
pub(crate) fn batches(
    path: &Path,
    each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    chosen_batches(path, None, each)
}

fn chosen_batches(
    path: &Path,
    choice: Option<&Choice<'_>>,
    mut each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::read(path))?;
    let failed = |e: &dyn std::fmt::Display| DatasetError::file(path, format!("cannot be read: {e}"));
    let mut reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| failed(&e))?;
    if let Some(Choice { rows, columns }) = choice {
        let held = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or_default();
        let rows = RowSelection::from_consecutive_ranges(rows.iter().map(|row| *row..row + 1), held);
        reader = reader.with_row_selection(rows);
        if !columns.is_empty() {
            let mask = ProjectionMask::columns(reader.parquet_schema(), columns.iter().copied());
            reader = reader.with_projection(mask);
        }
    }
    let reader = reader.with_batch_size(BATCH_ROWS).build().map_err(|e| failed(&e))?;
    for batch in reader {
        if !each(&batch.map_err(|e| failed(&e))?)? {
            break;
        }
    }
    Ok(())
}

/// Row `row` of `array` as JSON.
pub(crate) fn json(array: &ArrayRef, row: usize) -> Value {
    if array.is_null(row) {
        return Value::Null;
    }
    match array.data_type() {
        DataType::Utf8 => array.as_string::<i32>().value(row).into(),
        DataType::Boolean => array.as_boolean().value(row).into(),
        DataType::Int32 => array.as_primitive::<Int32Type>().value(row).into(),
        DataType::Int64 => array.as_primitive::<Int64Type>().value(row).into(),
        DataType::Float32 => shortest(array.as_primitive::<Float32Type>().value(row)),
        DataType::FixedSizeList(..) => {
            let list = array.as_fixed_size_list().value(row);
            (0..list.len()).map(|k| json(&list, k)).collect()
        }
        _ => Value::Null,
    }
}

/// A single-precision number with the digits that tell it from its neighbours.
fn shortest(value: f32) -> Value {
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}

/// All numbers of a column, lists one after the other; true counts as 1. Texts have none.
pub(crate) fn numbers(array: &ArrayRef, mut each: impl FnMut(f64)) {
    match array.data_type() {
        DataType::Boolean => array
            .as_boolean()
            .iter()
            .flatten()
            .for_each(|v| each(f64::from(u8::from(v)))),
        DataType::Int32 => array
            .as_primitive::<Int32Type>()
            .iter()
            .flatten()
            .for_each(|v| each(v.into())),
        DataType::Int64 => array
            .as_primitive::<Int64Type>()
            .iter()
            .flatten()
            .for_each(|v| each(v as f64)),
        DataType::Float32 => array
            .as_primitive::<Float32Type>()
            .iter()
            .flatten()
            .for_each(|v| each(v.into())),
        DataType::FixedSizeList(..) => numbers(array.as_fixed_size_list().values(), each),
        _ => {}
    }
}

/// Row `row` of a batch with these columns, as a JSON object.
fn object(schema: &Schema, columns: &[ArrayRef], row: usize) -> Value {
    let fields = schema.fields().iter().zip(columns);
    fields
        .map(|(field, array)| (field.name().clone(), json(array, row)))
        .collect()
}

impl Dataset {
    /// The first `rows` rows, each an object of its columns.
    ///
    /// # Errors
    /// [`DatasetError`] when a file is missing or cannot be read.
    pub fn head(&self, rows: u64) -> Result<Vec<Value>, DatasetError> {
        let mut found = Vec::new();
        let wanted = (0..rows.min(self.spec().config().rows)).collect();
        self.rows(&wanted, &[], |row| {
            found.push(row);
            Ok(())
        })?;
        Ok(found)
    }

    /// Calls `each` with the rows `wanted` in rising order, each an object of the columns called `columns`, or of all
    /// columns when none is named. Only the files that have these rows are read.
    ///
    /// # Errors
    /// [`DatasetError`] when a row is beyond the last one, when a file is missing or cannot be read, and that of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        wanted.last().map_or(Ok(()), |row| self.spec().check_row(*row))?;
        let shards: BTreeSet<u64> = wanted.iter().map(|row| row / self.spec().rows_per_shard()).collect();
        for shard in shards {
            let (path, held) = (self.shard_file(shard), shard_rows(self.spec(), shard));
            check_shard(self.spec(), shard, &path)?;
            let places = wanted.range(held.clone()).map(|row| row - held.start);
            let choice = Choice {
                rows: places.filter_map(|place| usize::try_from(place).ok()).collect(),
                columns,
            };
            chosen_batches(&path, Some(&choice), |batch| {
                let schema = batch.schema();
                (0..batch.num_rows()).try_for_each(|row| each(object(&schema, batch.columns(), row)))?;
                Ok(true)
            })?;
        }
        Ok(())
    }
}

impl Spec {
    /// Makes the rows `wanted` and writes no file: calls `each` with them as [`Dataset::rows`] does with those of files.
    ///
    /// # Errors
    /// [`DatasetError`] when a row is beyond the last one or cannot be made, and that of `each`.
    pub fn rows(
        &self,
        wanted: &BTreeSet<u64>,
        columns: &[&str],
        mut each: impl FnMut(Value) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        wanted.last().map_or(Ok(()), |row| self.check_row(*row))?;
        let schema = schema(self);
        let kept = |name: &str| columns.is_empty() || columns.contains(&name);
        let places = (0..schema.fields().len()).filter(|k| kept(schema.field(*k).name()));
        let places: Vec<usize> = places.collect();
        let failed = |e: ArrowError| DatasetError::file(&self.config().name, e.to_string());
        let kept_schema = schema.project(&places).map_err(failed)?;
        let mut stores = stores(self);
        let mut maker = Maker::new(self);
        for &row in wanted {
            put(&maker.row(row)?, &mut stores);
            let arrays = stores.iter_mut().map(Store::take).collect::<Result<Vec<_>, _>>();
            let arrays = arrays.map_err(failed)?;
            let kept: Vec<ArrayRef> = places.iter().map(|k| ArrayRef::clone(&arrays[*k])).collect();
            each(object(&kept_schema, &kept, 0))?;
        }
        Ok(())
    }

    /// Refuses a row beyond the last one.
    fn check_row(&self, row: u64) -> Result<(), DatasetError> {
        let SpecConfig { name, rows, .. } = self.config();
        if row < *rows {
            return Ok(());
        }
        let problem = format!("has no row {row}; valid: [0, {}]", rows - 1);
        Err(DatasetError::file(name, problem))
    }
}
