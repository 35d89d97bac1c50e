//! Why a spec is refused.

use spts::ChainError;
use spts_contact::ContactError;
use spts_contact::mesh::MeshError;
use spts_models::ConfigError;
use std::path::PathBuf;

/// A spec that cannot be made. The message names the field, its value and what is valid.
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
    /// No TOML, an unknown field, or a value of the wrong type.
    #[error("{0}")]
    Syntax(String),
    /// A number outside its range.
    #[error(transparent)]
    Value(#[from] ConfigError),
    /// A name, or two values that do not go together.
    #[error("{0}")]
    Choice(String),
    /// The contact field is refused.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Transducer, readout, weights or faults are refused.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// A mesh file is refused.
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
