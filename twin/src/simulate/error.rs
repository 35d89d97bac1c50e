//! Errors of `spts simulate`.

use crate::record::TwinError;
use crate::scene::{AssignError, SceneError};
use std::path::PathBuf;

/// Why a simulation could not start or continue.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Mechanics, transducer or readout failed, or the scene is too large.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// A name that is neither a known scene nor a scene file.
    #[error("SCENE = \"{name}\" is not press/NAME, press with --mesh, bounce, arm, or a file that ends in .toml")]
    UnknownScene {
        /// The name.
        name: String,
    },
    /// A value that cannot be put into the scene.
    #[error(transparent)]
    Assign(#[from] AssignError),
    /// A file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}
