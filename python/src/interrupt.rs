//! Long calls that Ctrl-C stops.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

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
