//! Reads the files of a data set.

use crate::error::DatasetError;
use crate::store::Kind;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use arrow_schema::{ArrowError, DataType};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowPredicateFn, ParquetRecordBatchReaderBuilder, RowFilter, RowSelection};
use parquet::file::metadata::RowGroupMetaData;
use serde_json::Value;
use std::fs::File;
use std::path::Path;

/// Most rows that are read together, and their bytes, so that large rows take no more memory than small ones.
const BATCH_ROWS: usize = 256;
const BATCH_BYTES: usize = 16 << 20;

/// Which rows of a file are read.
pub(crate) enum Wanted<'a> {
    /// All rows.
    All,
    /// Rows whose column `split` has this value.
    Split(&'static str),
    /// Rows at these places in the file, in increasing order, and only the named columns of them; all columns if none
    /// is named.
    Places(Vec<usize>, &'a [&'a str]),
}

/// Calls `each` with the rows of the file `path`, some at a time, until it says that it has had enough.
pub(crate) fn batches(
    path: &Path,
    wanted: Wanted<'_>,
    mut each: impl FnMut(&RecordBatch) -> Result<bool, DatasetError>,
) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::read(path))?;
    let failed = |e: &dyn std::fmt::Display| DatasetError::file(path, format!("cannot be read: {e}"));
    let mut reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| failed(&e))?;
    let row_bytes = reader.metadata().row_groups().iter().map(row_bytes).max();
    let rows = (BATCH_BYTES / row_bytes.unwrap_or(1)).clamp(1, BATCH_ROWS);
    match wanted {
        Wanted::All => {}
        Wanted::Split(split) => {
            let column = ProjectionMask::columns(reader.parquet_schema(), ["split"]);
            let of_split = ArrowPredicateFn::new(column, move |batch: RecordBatch| {
                let found = batch.columns().first().and_then(|array| array.as_string_opt::<i32>());
                let found =
                    found.ok_or_else(|| ArrowError::SchemaError("column `split` is not of texts".to_owned()))?;
                Ok(found.iter().map(|text| Some(text == Some(split))).collect())
            });
            reader = reader.with_row_filter(RowFilter::new(vec![Box::new(of_split)]));
        }
        Wanted::Places(places, columns) => {
            let held = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or_default();
            let places = RowSelection::from_consecutive_ranges(places.iter().map(|row| *row..row + 1), held);
            reader = reader.with_row_selection(places);
            if !columns.is_empty() {
                let mask = ProjectionMask::columns(reader.parquet_schema(), columns.iter().copied());
                reader = reader.with_projection(mask);
            }
        }
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

/// The values of a column. Values of lists are concatenated.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// Numbers of single precision; NaN where there is no value.
    Floats(Vec<f32>),
    /// Whole numbers; −1 where there is no value.
    Integers(Vec<i64>),
    /// True or false.
    Flags(Vec<bool>),
    /// Texts; empty where there is no value.
    Texts(Vec<String>),
}

impl ColumnValues {
    /// None yet, of the type `kind`.
    pub(crate) fn of(kind: Kind) -> Self {
        match kind {
            Kind::F32 => Self::Floats(Vec::new()),
            Kind::I32 | Kind::I64 => Self::Integers(Vec::new()),
            Kind::Bool => Self::Flags(Vec::new()),
            Kind::Text => Self::Texts(Vec::new()),
        }
    }

    /// Adds all values of `array`.
    pub(crate) fn extend(&mut self, array: &ArrayRef) {
        if let DataType::FixedSizeList(..) = array.data_type() {
            let lists = array.as_fixed_size_list();
            let length = usize::try_from(lists.value_length()).unwrap_or_default();
            let first = lists.value_offset_at(0);
            self.extend(&lists.values().slice(first, lists.len() * length));
            return;
        }
        match (self, array.data_type()) {
            (Self::Floats(all), DataType::Float32) => {
                let values = array.as_primitive::<Float32Type>().iter();
                all.extend(values.map(|v| v.unwrap_or(f32::NAN)));
            }
            (Self::Integers(all), DataType::Int32) => {
                let values = array.as_primitive::<Int32Type>().iter();
                all.extend(values.map(|v| v.map_or(-1, i64::from)));
            }
            (Self::Integers(all), DataType::Int64) => {
                all.extend(array.as_primitive::<Int64Type>().iter().map(|v| v.unwrap_or(-1)));
            }
            (Self::Flags(all), DataType::Boolean) => {
                all.extend(array.as_boolean().iter().map(Option::unwrap_or_default));
            }
            (Self::Texts(all), DataType::Utf8) => {
                let texts = array.as_string::<i32>().iter();
                all.extend(texts.map(|text| text.unwrap_or_default().to_owned()));
            }
            _ => {}
        }
    }
}
