//! Threads that survive a fork: those of `rayon` stay with the process that started them.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// The process that imported the package; the threads of `rayon`'s pool are its.
static HOME: AtomicU32 = AtomicU32::new(0);

/// Remembers that this process imports the package.
pub(crate) fn at_home() {
    HOME.store(std::process::id(), Ordering::Relaxed);
}

/// What `work` computes: on `rayon`'s pool, or in a fork of the process that imported the package on threads of its own,
/// which end with it.
pub(crate) fn on_threads<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if HOME.load(Ordering::Relaxed) == std::process::id() {
        return Ok(work());
    }
    let own = rayon::ThreadPoolBuilder::new().build();
    let own = own.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(own.install(work))
}
