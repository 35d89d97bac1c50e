//! Arrow arrays of numbers, in the types that LeRobot reads.

use super::episode::{integer, single};
use super::features::{Feature, Scalar};
use arrow_array::builder::{ListBuilder, PrimitiveBuilder};
use arrow_array::types::{ArrowPrimitiveType, Float32Type, Float64Type, Int64Type};
use arrow_array::{ArrayRef, FixedSizeListArray, PrimitiveArray};
use arrow_schema::{ArrowError, DataType, Field};
use std::sync::Arc;

/// Type of a feature's column: a scalar for one value, a list of fixed length for one side, nested lists for two.
pub(super) fn column_type(feature: &Feature) -> DataType {
    let scalar = match feature.scalar {
        Scalar::F32 => DataType::Float32,
        Scalar::I64 => DataType::Int64,
    };
    match feature.shape[..] {
        [1] => scalar,
        [length] => {
            let length = i32::try_from(length).unwrap_or(i32::MAX);
            DataType::FixedSizeList(item(scalar), length)
        }
        _ => nested(scalar, 2),
    }
}

/// Lists of `scalar`, one in the other.
pub(super) fn nested(scalar: DataType, depth: usize) -> DataType {
    (0..depth).fold(scalar, |inner, _| DataType::List(item(inner)))
}

fn item(inner: DataType) -> Arc<Field> {
    Arc::new(Field::new_list_field(inner, true))
}

/// The column of a feature, frame by frame.
///
/// # Errors
/// [`ArrowError`] when the values are no whole number of frames.
pub(super) fn column(feature: &Feature, values: &[f64]) -> Result<ArrayRef, ArrowError> {
    match feature.scalar {
        Scalar::F32 => of::<Float32Type>(feature, values.iter().map(|v| single(*v))),
        Scalar::I64 => of::<Int64Type>(feature, values.iter().map(|v| integer(*v))),
    }
}

fn of<T: ArrowPrimitiveType>(
    feature: &Feature,
    values: impl Iterator<Item = T::Native>,
) -> Result<ArrayRef, ArrowError> {
    match feature.shape[..] {
        [1] => Ok(lists::<T>(values, &[])),
        [length] => {
            let flat = lists::<T>(values, &[]);
            let length = i32::try_from(length).unwrap_or(i32::MAX);
            Ok(Arc::new(FixedSizeListArray::try_new(
                item(T::DATA_TYPE),
                length,
                flat,
                None,
            )?))
        }
        _ => Ok(lists::<T>(values, &feature.shape)),
    }
}

/// Lists of doubles with the shape of a feature: what a statistic of it is.
pub(super) fn statistic(feature: &Feature, values: impl Iterator<Item = f64>) -> ArrayRef {
    lists::<Float64Type>(values, &feature.shape)
}

/// Values as numbers, lists or lists of lists: for no, one or two sides.
pub(super) fn lists<T: ArrowPrimitiveType>(values: impl Iterator<Item = T::Native>, shape: &[usize]) -> ArrayRef {
    let flat = PrimitiveBuilder::<T>::new();
    match *shape {
        [] => Arc::new(PrimitiveArray::<T>::from_iter_values(values)),
        [length] => {
            let mut list = ListBuilder::new(flat);
            for (k, value) in (1..).zip(values) {
                list.values().append_value(value);
                if k % length == 0 {
                    list.append(true);
                }
            }
            Arc::new(list.finish())
        }
        [rows, cols, ..] => {
            let mut list = ListBuilder::new(ListBuilder::new(flat));
            for (k, value) in (1..).zip(values) {
                list.values().values().append_value(value);
                if k % cols == 0 {
                    list.values().append(true);
                }
                if k % (rows * cols) == 0 {
                    list.append(true);
                }
            }
            Arc::new(list.finish())
        }
    }
}
