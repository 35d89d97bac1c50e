//! Whole numbers that come from Python.

use crate::refuse::refuse;
use pyo3::PyResult;

/// The number `value` of the argument `field`, which must be a whole one from 0 on that `T` holds.
pub(crate) fn whole<T: TryFrom<i128>>(field: &str, value: i128) -> PyResult<T> {
    T::try_from(value).map_err(|_| {
        let bits = 8 * size_of::<T>();
        refuse(format!("`{field}` = {value} is outside [0, 2^{bits})"))
    })
}
