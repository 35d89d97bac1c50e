//! Python bindings of the tactile-skin twin: the module `spts._spts`.

mod body;
mod command;
mod count;
mod dataset;
mod decode;
mod interrupt;
mod mount;
mod pose;
mod recorded;
mod refuse;
mod score;
mod scorer;
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
    use super::command::{command_line, shipped_specs};
    #[pymodule_export]
    use super::dataset::DataFolder;
    #[pymodule_export]
    use super::decode::{Decoder, ImageClassifier, decoder_table};
    #[pymodule_export]
    use super::mount::Mount;
    #[pymodule_export]
    use super::recorded::{Recording, Session, load};
    #[pymodule_export]
    use super::score::support_scores;
    #[pymodule_export]
    use super::scorer::score_sessions;
    #[pymodule_export]
    use super::skin::{Skin, Touch};
    #[pymodule_export]
    use super::wire::Wire;
}
