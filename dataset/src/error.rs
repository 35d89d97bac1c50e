//! Errors of data sets.

use crate::make::RowError;
use crate::spec::SpecError;
use spts::output::OutputError;
use std::path::PathBuf;

/// Why a data set cannot be made, checked or read. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The specification is not valid.
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
    /// The content of a file is not valid.
    #[error("{}: {problem}", path.display())]
    File {
        /// File or folder.
        path: PathBuf,
        /// The problem, and what to do.
        problem: String,
    },
    /// The part of a worker is not valid.
    #[error("{0}")]
    Part(String),
    /// The data set does not fit an export format.
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
