//! Parameters that come from Python.

use crate::refuse::refuse;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::Value;

/// How deep dictionaries and lists may lie in each other.
const DEEPEST: usize = 16;

/// The table that `dict` is; `field` names it in errors.
pub(crate) fn table(field: &str, dict: &Bound<'_, PyDict>) -> PyResult<toml::Table> {
    table_at(field, dict, 0)
}

fn table_at(field: &str, dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<toml::Table> {
    let entry = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key
            .extract()
            .map_err(|_| refuse(format!("`{field}` has a key that is no text")))?;
        let value = value_at(&format!("{field}[\"{key}\"]"), &value, depth + 1)?;
        Ok((key, value))
    };
    dict.iter().map(entry).collect()
}

fn value_at(field: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(refuse(format!("`{field}` lies deeper than {DEEPEST} tables")));
    }
    // True is an int to Python
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let number = value
            .extract()
            .map_err(|_| refuse(format!("`{field}` = {value} is outside [-2^63, 2^63)")))?;
        return Ok(Value::Integer(number));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Value::Table(table_at(field, dict, depth)?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.enumerate();
        let items = items.map(|(k, item)| value_at(&format!("{field}[{k}]"), &item?, depth + 1));
        return Ok(Value::Array(items.collect::<PyResult<_>>()?));
    }
    // a number of NumPy
    if let Ok(item) = value.call_method0("item") {
        return value_at(field, &item, depth + 1);
    }
    Err(refuse(format!(
        "`{field}` is a {}; numbers, texts, lists and dictionaries are taken",
        value.get_type().name()?
    )))
}
