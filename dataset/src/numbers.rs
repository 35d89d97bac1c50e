//! Numbers in Parquet files that others have written.

use crate::file::{Wanted, batches, refused};
use arrow_array::cast::AsArray as _;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{Array as _, ArrayRef};
use arrow_schema::{DataType, TimeUnit};
use spts::Refusal;
use std::path::Path;

/// Most numbers of a file: 1 GB of doubles.
const MOST: usize = 1 << 27;

/// Columns of numbers: name, and a number a row; NaN where there is none.
pub type NumberColumns = Vec<(String, Vec<f64>)>;

/// The numbers in the columns of the Parquet file at `path`, and the names of columns that hold something else. A
/// column of lists gives a column for each place in them. Instants are in seconds since 1970.
///
/// # Errors
/// [`Refusal`] if the file is not Parquet, lists of one column differ in length, or it holds too many numbers.
pub fn numbers_of(path: &Path) -> Result<(NumberColumns, Vec<String>), Refusal> {
    let (mut found, mut other): (NumberColumns, Vec<String>) = (Vec::new(), Vec::new());
    let mut count = 0;
    let uneven =
        |column: &str, row: usize| refused(path, format!("column `{column}`, row {row}: a list of another length"));
    batches(path, Wanted::All, |batch| {
        let mut next = 0;
        for (field, array) in batch.schema().fields().iter().zip(batch.columns()) {
            let (values, places) = match array.data_type() {
                DataType::FixedSizeList(..) => {
                    let lists = array.as_fixed_size_list();
                    in_rows(lists.iter()).map_err(|row| uneven(field.name(), row))?
                }
                DataType::List(_) => in_rows(array.as_list::<i32>().iter()).map_err(|row| uneven(field.name(), row))?,
                DataType::LargeList(_) => {
                    in_rows(array.as_list::<i64>().iter()).map_err(|row| uneven(field.name(), row))?
                }
                _ => (numbers(array), 1),
            };
            let Some(values) = values else {
                if !other.contains(field.name()) {
                    other.push(field.name().clone());
                }
                continue;
            };
            count += values.len();
            if count > MOST {
                return Err(refused(path, format!("holds more than {MOST} numbers")));
            }
            for place in 0..places {
                if found.len() == next {
                    found.push((field.name().clone(), Vec::new()));
                }
                found[next].1.extend(values.iter().skip(place).step_by(places));
                next += 1;
            }
        }
        if found.len() != next || found.iter().any(|(_, column)| column.len() != found[0].1.len()) {
            return Err(refused(
                path,
                "lists of a column are of one length in some rows, and of another in others".to_owned(),
            ));
        }
        Ok(true)
    })?;
    Ok((found, other))
}

/// The numbers of lists, row after row, and how many there are in a row; no numbers where they are something else. A
/// row without a list has NaN.
///
/// # Errors
/// The first row with a list of another length.
fn in_rows(lists: impl Iterator<Item = Option<ArrayRef>> + Clone) -> Result<(Option<Vec<f64>>, usize), usize> {
    let places = lists.clone().flatten().map(|list| list.len()).next().unwrap_or(0);
    let mut values = Vec::new();
    for (row, list) in lists.enumerate() {
        match list {
            Some(list) if list.len() != places => return Err(row),
            Some(list) => match numbers(&list) {
                Some(own) => values.extend(own),
                None => return Ok((None, places)),
            },
            None => values.extend(std::iter::repeat_n(f64::NAN, places)),
        }
    }
    Ok((Some(values), places))
}

/// The values of `array` if they are numbers.
fn numbers(array: &ArrayRef) -> Option<Vec<f64>> {
    macro_rules! of {
        ($type:ty, $scale:expr) => {{
            #[expect(clippy::allow_attributes, reason = "some types need no cast")]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one line for all types")]
            let values = array.as_primitive::<$type>().iter().map(|v| v.map_or(f64::NAN, |v| $scale * v as f64));
            values.collect()
        }};
    }
    Some(match array.data_type() {
        DataType::Float64 => of!(Float64Type, 1.0),
        DataType::Float32 => of!(Float32Type, 1.0),
        DataType::Int8 => of!(Int8Type, 1.0),
        DataType::Int16 => of!(Int16Type, 1.0),
        DataType::Int32 => of!(Int32Type, 1.0),
        DataType::Int64 => of!(Int64Type, 1.0),
        DataType::UInt8 => of!(UInt8Type, 1.0),
        DataType::UInt16 => of!(UInt16Type, 1.0),
        DataType::UInt32 => of!(UInt32Type, 1.0),
        DataType::UInt64 => of!(UInt64Type, 1.0),
        DataType::Timestamp(TimeUnit::Second, _) => of!(TimestampSecondType, 1.0),
        DataType::Timestamp(TimeUnit::Millisecond, _) => of!(TimestampMillisecondType, 1e-3),
        DataType::Timestamp(TimeUnit::Microsecond, _) => of!(TimestampMicrosecondType, 1e-6),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => of!(TimestampNanosecondType, 1e-9),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::{Float32Array, ListArray, RecordBatch, StringArray, TimestampMillisecondArray};
    use parquet::arrow::ArrowWriter;
    use std::sync::Arc;

    #[test]
    fn columns_of_numbers_are_read_and_others_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.parquet");
        let lists =
            ListArray::from_iter_primitive::<Int32Type, _, _>([[1, 2], [3, 4]].map(|row| Some(row.map(Some).to_vec())));
        let batch = RecordBatch::try_from_iter([
            ("time", Arc::new(TimestampMillisecondArray::from(vec![0, 20])) as ArrayRef),
            ("taxels", Arc::new(lists)),
            ("force", Arc::new(Float32Array::from(vec![Some(0.5), None]))),
            ("label", Arc::new(StringArray::from(vec!["a", "b"]))),
        ])
        .unwrap();
        let mut writer = ArrowWriter::try_new(std::fs::File::create(&path).unwrap(), batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        let (columns, other) = numbers_of(&path).unwrap();
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!((names, other), (vec!["time", "taxels", "taxels", "force"], vec!["label".to_owned()]));
        assert_eq!((&columns[0].1, &columns[1].1, &columns[2].1), (&vec![0.0, 0.02], &vec![1.0, 3.0], &vec![2.0, 4.0]));
        assert_eq!(columns[3].1[0].to_bits(), 0.5_f64.to_bits());
        assert!(columns[3].1[1].is_nan());
        std::fs::write(&path, "PAR1").unwrap();
        assert!(numbers_of(&path).unwrap_err().to_string().contains("a.parquet: cannot be read"));
    }
}
