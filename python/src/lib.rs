//! Python bindings of the tactile-skin twin: the module `spts._spts`.

mod body;
mod decode;
mod mount;
mod pose;
mod refuse;
mod score;
mod skin;
mod value;
mod wire;

use pyo3::prelude::*;

/// What the package `spts` is made of.
#[pymodule]
mod _spts {
    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::decode::{Decoder, ImageClassifier, decoder_table};
    #[pymodule_export]
    use super::mount::Mount;
    #[pymodule_export]
    use super::score::support_scores;
    #[pymodule_export]
    use super::skin::{Skin, Touch};
    #[pymodule_export]
    use super::wire::Wire;
}
