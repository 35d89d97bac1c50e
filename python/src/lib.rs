//! Python bindings of the tactile-skin twin: the module `spts._spts`.

mod body;
mod pose;
mod refuse;
mod skin;
mod wire;

use pyo3::prelude::*;

/// What the package `spts` is made of.
#[pymodule]
mod _spts {
    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::skin::{Skin, Touch};
    #[pymodule_export]
    use super::wire::Wire;
}
