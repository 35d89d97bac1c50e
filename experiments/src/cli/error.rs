//! One error for the command line: every cause ends in one clear message and exit status 2.

use crate::data::DataError;
use crate::output::OutputError;
use crate::simulate::SimulateError;
use std::path::{Path, PathBuf};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// A recording cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A scene cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The twin cannot be run.
    #[error(transparent)]
    Twin(#[from] crate::twin::TwinError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] crate::figures::FigureError),
    /// A file cannot be written or read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// An option or a file's content is not usable.
    #[error("{0}")]
    Usage(String),
}

impl CliError {
    /// Wraps an I/O error with the path it concerns.
    pub fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io {
            path: path.clone(),
            source,
        }
    }
}
