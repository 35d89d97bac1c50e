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
    /// Another run writes to the folder.
    #[error("{}: another run is writing to this folder; choose another one, or wait until that run has ended", folder.display())]
    Locked {
        /// Folder.
        folder: PathBuf,
    },
    /// A file that no run has written has the name of a result.
    #[error("{}: is not a result of an earlier run and is not replaced; move it away or choose another folder", path.display())]
    NotOurs {
        /// File in the way.
        path: PathBuf,
    },
    /// A file is not what the run wrote that its folder's manifest lists.
    #[error("{}: is not the file that {} lists; {advice}", path.display(), manifest.display())]
    Changed {
        /// File.
        path: PathBuf,
        /// Manifest that lists it.
        manifest: PathBuf,
        /// What the user can do.
        advice: &'static str,
    },
    /// A run was ended while it put its results in place.
    #[error(
        "{}: is half-made: a run was ended while it put its results in place; any run with this folder as its output first puts the earlier results back",
        folder.display()
    )]
    HalfMade {
        /// Folder.
        folder: PathBuf,
    },
    /// A folder or a device is where a result should be.
    #[error("{}: is not a regular file and is not replaced", path.display())]
    NotRegular {
        /// What is in the way.
        path: PathBuf,
    },
    /// A field of what is written is outside its range.
    #[error("{}: cannot be written: `{field}` = {value} is outside {range}", path.display())]
    Field {
        /// File.
        path: PathBuf,
        /// Name of the field, with the names of what it lies in.
        field: String,
        /// Its value.
        value: String,
        /// Valid range.
        range: String,
    },
    /// A file that would be too large to be read again.
    #[error("{}: cannot be written: `{what}` = {bytes} bytes is outside [0, {limit}], which is read", path.display())]
    TooLarge {
        /// File.
        path: PathBuf,
        /// What the file holds.
        what: String,
        /// Its size, bytes.
        bytes: u64,
        /// Largest size that is read, bytes.
        limit: u64,
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
