//! Why a result could not be written.

use std::io;
use std::path::{Path, PathBuf};

/// A result that could not be written. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The file system said no: full disk, no permission, no such folder.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// File.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The output folder cannot be made.
    #[error("{}: the output folder cannot be made: {source}", path.display())]
    Folder {
        /// Folder.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// A file is where the output folder should be.
    #[error("{}: is a file; the output has to be a folder", path.display())]
    IsFile {
        /// File in the way.
        path: PathBuf,
    },
    /// A folder or a device is where a result should be.
    #[error("{}: is not a regular file and is not replaced", path.display())]
    NotRegular {
        /// What is in the way.
        path: PathBuf,
    },
    /// The values do not fill the shape.
    #[error("{}: {values} values for an array of shape {shape:?}", path.display())]
    Shape {
        /// File.
        path: PathBuf,
        /// Shape asked for.
        shape: Vec<usize>,
        /// Number of values.
        values: usize,
    },
}

impl OutputError {
    /// The same error with `place` of its path.
    #[must_use]
    pub fn relocated(mut self, place: &dyn Fn(&Path) -> PathBuf) -> Self {
        let (Self::Write { path, .. }
        | Self::Folder { path, .. }
        | Self::IsFile { path }
        | Self::NotRegular { path }
        | Self::Shape { path, .. }) = &mut self;
        *path = place(path);
        self
    }

    /// Wraps an I/O error with the file it concerns.
    pub(super) fn write(path: &Path) -> impl Fn(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Write {
            path: path.clone(),
            source,
        }
    }
}
