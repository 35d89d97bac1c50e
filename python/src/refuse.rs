//! Errors as Python has them.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// A `ValueError` that says what `error` says.
pub(crate) fn refuse(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
