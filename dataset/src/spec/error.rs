//! Errors of specifications.

use spts_contact::mesh::MeshError;
use spts_models::ConfigError;
use std::path::PathBuf;

/// Why a specification is not valid. The message names the field, its value and what is valid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// Cause.
        source: spts_input::InputError,
    },
    /// Text that is not TOML, an unknown field, or a value of the wrong type.
    #[error("{0}")]
    Syntax(String),
    /// A number outside its range, or a contact model, transducer, readout, weights or faults that are not valid.
    #[error(transparent)]
    Value(#[from] ConfigError),
    /// A name that does not exist, or two values that contradict each other.
    #[error("{0}")]
    Choice(String),
    /// A mesh file is not valid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The folder of mesh files cannot be read.
    #[error("`object.folder`: {}: {source}", path.display())]
    Folder {
        /// Folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}
