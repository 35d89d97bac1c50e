//! What all bindings have in common: errors, dictionaries as tables, and long calls that Ctrl-C stops.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use toml::Value;

/// Ends a function with a `ValueError` of this format.
#[allow(unused_macros, reason = "the part with a physics engine has no use for it")]
macro_rules! bail {
    ($($format:tt)+) => {
        return Err($crate::common::refuse(format!($($format)+)))
    };
}

/// A `ValueError` that says what `error` says.
pub(crate) fn refuse(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// How deep dictionaries and lists may lie in each other.
const DEEPEST: usize = 16;

/// The table that `dict` is; `field` names it in errors.
pub(crate) fn table(field: &str, dict: &Bound<'_, PyDict>) -> PyResult<toml::Table> {
    table_at(field, dict, 0)
}

fn table_at(field: &str, dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<toml::Table> {
    let entry = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key.extract().map_err(|_| refuse(format!("`{field}` has a key that is no text")))?;
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
        let number = value.extract().map_err(|_| refuse(format!("`{field}` = {value} is outside [-2^63, 2^63)")))?;
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

/// Time between two looks at whether Ctrl-C was pressed.
const LOOK: Duration = Duration::from_millis(20);

/// What unwinds a computation that is stopped.
struct Stopped;

/// Computes `work` on a thread of its own, without the interpreter's lock, and stops it when Ctrl-C is pressed: at its
/// next call of the function that it is given.
pub(crate) fn stoppable<T: Send>(py: Python<'_>, work: impl FnOnce(&(dyn Fn() + Sync)) -> T + Send) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let mut interrupted = None;
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let step = || {
                if stop.load(Ordering::Relaxed) {
                    // no message: this is no failure
                    resume_unwind(Box::new(Stopped));
                }
            };
            let (sender, ended) = channel();
            scope.spawn(move || sender.send(catch_unwind(AssertUnwindSafe(|| work(&step)))));
            loop {
                match ended.recv_timeout(LOOK) {
                    Ok(done) => return Some(done),
                    Err(RecvTimeoutError::Disconnected) => return None,
                    Err(RecvTimeoutError::Timeout) => {}
                }
                if interrupted.is_none()
                    && let Err(error) = Python::attach(|py| py.check_signals())
                {
                    interrupted = Some(error);
                    stop.store(true, Ordering::Relaxed);
                }
            }
        })
    });
    match (interrupted, done) {
        (Some(error), _) => Err(error),
        (None, Some(Ok(value))) => Ok(value),
        (None, Some(Err(panic))) => resume_unwind(panic),
        (None, None) => Err(PyRuntimeError::new_err("the computation ended without a result")),
    }
}
