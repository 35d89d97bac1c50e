//! What the Python package does with a physics engine: the module `spts._scenes`.

#[path = "../../src/common.rs"]
mod common;
#[path = "../../src/dataset.rs"]
mod dataset;
mod simulate;

use pyo3::prelude::*;

/// What `spts.simulate` and data sets that move in time are made of.
#[pymodule]
mod _scenes {
    #[pymodule_export]
    use super::dataset::DataFolder;
    #[pymodule_export]
    use super::simulate::simulate;
}
