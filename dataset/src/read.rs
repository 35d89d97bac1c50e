//! Reading the files of a data set.

use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::shard::check_shard;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;
use std::fs::File;
use std::path::Path;

/// Rows that are read together.
const BATCH_ROWS: usize = 256;

/// Calls `each` with the rows of the file `path`, some at a time.
pub(crate) fn batches(
    path: &Path,
    mut each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::read(path))?;
    let failed = |e: &dyn std::fmt::Display| DatasetError::file(path, format!("cannot be read: {e}"));
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| failed(&e))?;
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
