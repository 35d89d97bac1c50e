//! Errors as Python has them.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, PyResult};

/// A `ValueError` that says what `error` says.
pub(crate) fn refuse(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The number `value` of the argument `field`, which must be a whole one from 0 on that `T` holds.
pub(crate) fn whole<T: TryFrom<i128>>(field: &str, value: i128) -> PyResult<T> {
    T::try_from(value).map_err(|_| {
        let bits = 8 * size_of::<T>();
        refuse(format!("`{field}` = {value} is outside [0, 2^{bits})"))
    })
}
