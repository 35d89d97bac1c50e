//! The command line, as the console script runs it.

use pyo3::prelude::*;
use spts_dataset::NAMED_SPECS;
use std::ffi::OsString;

/// Runs the command line `arguments`, the first of which is the program's name; its exit status. Ctrl-C ends the
/// process.
#[pyfunction]
pub(crate) fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| spts_cli::main_with(arguments))
}

/// Names of the specs that ship.
#[pyfunction]
pub(crate) fn shipped_specs() -> Vec<&'static str> {
    NAMED_SPECS.iter().map(|(name, _)| *name).collect()
}
