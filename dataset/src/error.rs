//! Why a data set cannot be made, checked or read.

use crate::make::RowError;
use crate::spec::SpecError;
use spts::output::OutputError;
use std::path::PathBuf;

/// A data set that cannot be made, checked or read. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The spec is refused.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A row cannot be made.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {problem}", path.display())]
    File {
        /// File or folder.
        path: PathBuf,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A worker's part that is none.
    #[error("{0}")]
    Part(String),
    /// A data set that a format cannot hold.
    #[error("{0}")]
    Export(String),
}

impl DatasetError {
    /// The error of reading `path`.
    pub(crate) fn read(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        |source| Self::Read { path, source }
    }

    /// The error of a file at `path` with this problem.
    pub(crate) fn file(path: impl Into<PathBuf>, problem: impl Into<String>) -> Self {
        Self::File {
            path: path.into(),
            problem: problem.into(),
        }
    }
}
