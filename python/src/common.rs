//! What all bindings have in common: errors, dictionaries as tables, and long calls that Ctrl-C stops.

use pyo3::exceptions::{PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use toml::Value;

/// Ends a function with a `ValueError` of this format.
macro_rules! bail {
    ($($format:tt)+) => {
        return Err($crate::common::refuse(format!($($format)+)))
    };
}

/// A `ValueError` that says what `error` says.
pub(crate) fn refuse(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Warns the caller of `note`.
pub(crate) fn warn(py: Python<'_>, note: &str) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(note)?, 1)
}

/// `value` as the text that pickles hold.
pub(crate) fn to_toml(value: &impl Serialize) -> PyResult<String> {
    toml::to_string(value).map_err(refuse)
}

/// What such a text was made of.
pub(crate) fn of_toml<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    spts::models::parsed_text(text).map_err(refuse)
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

/// Most forks from process to process in which threads are used.
const FORKS: usize = 8;
/// Process that uses the threads (upper half), and the number of forks before it that did (lower half).
static PROCESS: AtomicU64 = AtomicU64::new(0);
/// The threads of processes after as many forks: a thread does not go along into a forked process.
static POOLS: [OnceLock<Option<ThreadPool>>; FORKS] = [const { OnceLock::new() }; FORKS];

/// Number of forks between the first process that used threads and this one.
fn forks() -> usize {
    let this = u64::from(std::process::id()) << 32;
    let known = PROCESS.fetch_update(Ordering::AcqRel, Ordering::Acquire, |known| match known {
        0 => Some(this),
        _ if known & !u64::from(u32::MAX) == this => None,
        _ => Some(this | ((known & u64::from(u32::MAX)) + 1)),
    });
    // none before the first, one more than before after a fork
    let forks = known.map_or_else(|same| same, |before| if before == 0 { 0 } else { before + 1 });
    usize::try_from(forks & u64::from(u32::MAX)).unwrap_or(usize::MAX)
}

/// Computes `work` on the threads of this process. Those of the process that it was forked from are not there.
pub(crate) fn on_threads<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let Some(forked) = forks().checked_sub(1) else {
        return Ok(work());
    };
    let Some(pool) = POOLS.get(forked) else {
        let message =
            format!("threads were used before each of {} forks, at most {FORKS}: spawn processes", forked + 1);
        return Err(PyRuntimeError::new_err(message));
    };
    match pool.get_or_init(|| ThreadPoolBuilder::new().build().ok()) {
        Some(pool) => Ok(pool.install(work)),
        None => Err(PyRuntimeError::new_err("no threads can be started in this forked process: spawn processes")),
    }
}

/// Computes `work` on the threads of this process, without the interpreter's lock.
pub(crate) fn released<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| on_threads(work))
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
            scope.spawn(move || sender.send(catch_unwind(AssertUnwindSafe(|| on_threads(|| work(&step))))));
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
        (None, Some(Ok(value))) => value,
        (None, Some(Err(panic))) => resume_unwind(panic),
        (None, None) => Err(PyRuntimeError::new_err("the computation ended without a result")),
    }
}
