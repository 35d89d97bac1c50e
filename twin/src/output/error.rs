//! Errors of writing results.

use std::io;
use std::path::{Path, PathBuf};

/// A result that could not be written. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The file system reports an error, such as a full disk, no permission, or a missing folder.
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
    /// A file has the name of the output folder.
    #[error("{}: is a file; the output has to be a folder", path.display())]
    IsFile {
        /// File that has the folder's name.
        path: PathBuf,
    },
    /// Another run is writing to the folder.
    #[error("{}: another run is writing to this folder; choose another one, or wait until that run has ended", folder.display())]
    Locked {
        /// Folder.
        folder: PathBuf,
    },
    /// A file that no run has written has the name of a result.
    #[error("{}: is not a result of an earlier run and is not replaced; move it away or choose another folder", path.display())]
    NotOurs {
        /// File that has the result's name.
        path: PathBuf,
    },
    /// A file differs from the one that the manifest of its folder lists.
    #[error("{}: is not the file that {} lists; {advice}", path.display(), manifest.display())]
    Changed {
        /// File.
        path: PathBuf,
        /// Manifest that lists the file.
        manifest: PathBuf,
        /// What the user can do.
        advice: &'static str,
    },
    /// A run ended while it moved its results into place.
    #[error(
        "{}: is half-made: a run was ended while it put its results in place; any run with this folder as its output first puts the earlier results back",
        folder.display()
    )]
    HalfMade {
        /// Folder.
        folder: PathBuf,
    },
    /// A folder or a device has the name of a result.
    #[error("{}: is not a regular file and is not replaced", path.display())]
    NotRegular {
        /// The folder or device.
        path: PathBuf,
    },
    /// A field of what is written is outside its range.
    #[error("{}: cannot be written: `{field}` = {value} is outside {range}", path.display())]
    Field {
        /// File.
        path: PathBuf,
        /// Name of the field, with the sections that contain it.
        field: String,
        /// Its value.
        value: String,
        /// Valid range.
        range: String,
    },
    /// A file that would be too large to read again.
    #[error("{}: cannot be written: `{what}` = {bytes} bytes is outside [0, {limit}], the sizes that can be read again", path.display())]
    TooLarge {
        /// File.
        path: PathBuf,
        /// Contents of the file.
        what: String,
        /// Its size, bytes.
        bytes: u64,
        /// Size of the largest file that is read, bytes.
        limit: u64,
    },
    /// The number of values differs from that of the shape.
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
    /// The same error, with `place` applied to its path.
    #[must_use]
    pub fn relocated(mut self, place: &dyn Fn(&Path) -> PathBuf) -> Self {
        let (Self::Write { path, .. }
        | Self::Folder { path, .. }
        | Self::IsFile { path }
        | Self::NotOurs { path }
        | Self::Locked { folder: path }
        | Self::HalfMade { folder: path }
        | Self::Changed { path, .. }
        | Self::NotRegular { path }
        | Self::Field { path, .. }
        | Self::TooLarge { path, .. }
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
