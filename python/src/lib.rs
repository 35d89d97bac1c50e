//! Python bindings of the tactile-skin twin: the module `spts._spts`.

#[macro_use]
mod common;
mod args;
mod body;
mod dataset;
mod decode;
mod mount;
mod recorded;
mod scorer;
mod simulate;
mod skin;
mod wire;

use pyo3::prelude::*;
use spts_dataset::NAMED_SPECS;
use std::ffi::OsString;

/// What the package `spts` is made of.
#[pymodule]
mod _spts {
    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::dataset::DataFolder;
    #[pymodule_export]
    use super::decode::{Decoder, ImageClassifier, auto_decoder, decoder_table};
    #[pymodule_export]
    use super::mount::{Mount, Mounts};
    #[pymodule_export]
    use super::recorded::{Recording, Session, load};
    #[pymodule_export]
    use super::scorer::{score_sessions, support_scores};
    #[pymodule_export]
    use super::simulate::{look_in, open_mujoco, simulate};
    #[pymodule_export]
    use super::skin::{Skin, Touch};
    #[pymodule_export]
    use super::wire::Wire;
    #[pymodule_export]
    use super::{command_line, shipped_specs};
}

/// Runs the command line `arguments`, the first of which is the program's name; its exit status. Ctrl-C ends the
/// process.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<u8> {
    common::released(py, || spts_cli::main_with(arguments))
}

/// Names of the specs that ship.
#[pyfunction]
fn shipped_specs() -> Vec<&'static str> {
    NAMED_SPECS.iter().map(|(name, _)| *name).collect()
}
