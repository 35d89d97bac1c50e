//! Reading the files of a data set.

use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::shard::check_shard;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use arrow_schema::{ArrowError, DataType};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowPredicateFn, ParquetRecordBatchReaderBuilder, RowFilter};
use parquet::file::metadata::RowGroupMetaData;
use serde_json::Value;
use std::fs::File;
use std::path::Path;

/// Most rows that are read together, and their bytes, so that large rows take no more memory than small ones.
const BATCH_ROWS: usize = 256;
const BATCH_BYTES: usize = 16 << 20;

/// Calls `each` with the rows of the file `path`, some at a time.
pub(crate) fn batches(
    path: &Path,
    each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    read(path, None, each)
}

/// [`batches`] of the rows alone whose column `split` says `split`.
pub(crate) fn batches_of_split(
    path: &Path,
    split: &'static str,
    each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    read(path, Some(split), each)
}

fn read(
    path: &Path,
    split: Option<&'static str>,
    mut each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::read(path))?;
    let failed = |e: &dyn std::fmt::Display| DatasetError::file(path, format!("cannot be read: {e}"));
    let mut reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| failed(&e))?;
    let row_bytes = reader.metadata().row_groups().iter().map(row_bytes).max();
    let rows = (BATCH_BYTES / row_bytes.unwrap_or(1)).clamp(1, BATCH_ROWS);
    if let Some(split) = split {
        let column = ProjectionMask::columns(reader.parquet_schema(), ["split"]);
        let of_split = ArrowPredicateFn::new(column, move |batch: RecordBatch| {
            let found = batch.columns().first().and_then(|array| array.as_string_opt::<i32>());
            let found = found.ok_or_else(|| ArrowError::SchemaError("column `split` is not of texts".to_owned()))?;
            Ok(found.iter().map(|text| Some(text == Some(split))).collect())
        });
        reader = reader.with_row_filter(RowFilter::new(vec![Box::new(of_split)]));
    }
    for batch in reader.with_batch_size(rows).build().map_err(|e| failed(&e))? {
        if !each(&batch.map_err(|e| failed(&e))?)? {
            break;
        }
    }
    Ok(())
}

/// Bytes of a row of `group` before compression, at least 1.
fn row_bytes(group: &RowGroupMetaData) -> usize {
    let [bytes, rows] = [group.total_byte_size(), group.num_rows()].map(|n| usize::try_from(n).unwrap_or_default());
    (bytes / rows.max(1)).max(1)
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

impl Dataset {
    /// The first `rows` rows, each an object of its columns.
    ///
    /// # Errors
    /// [`DatasetError`] when a file is missing or cannot be read.
    pub fn head(&self, rows: u64) -> Result<Vec<Value>, DatasetError> {
        let mut found = Vec::new();
        let mut shard = 0;
        while (found.len() as u64) < rows.min(self.spec().config().rows) {
            let path = self.shard_file(shard);
            check_shard(self.spec(), shard, &path)?;
            batches(&path, |batch| {
                let schema = batch.schema();
                for row in 0..batch.num_rows() {
                    if found.len() as u64 == rows {
                        return Ok(false);
                    }
                    let columns = schema.fields().iter().zip(batch.columns());
                    found.push(
                        columns
                            .map(|(field, array)| (field.name().clone(), json(array, row)))
                            .collect(),
                    );
                }
                Ok(true)
            })?;
            shard += 1;
        }
        Ok(found)
    }
}
