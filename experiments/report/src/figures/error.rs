//! What can go wrong while a figure is written.

use std::path::{Path, PathBuf};

/// A figure that could not be written. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// The file system said no.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] spts::output::OutputError),
    /// The picture could not be painted: most often no TrueType font is installed.
    #[error("{path}: cannot paint the figure ({reason}); is a sans-serif font such as DejaVu Sans installed?", path = path.display())]
    Paint {
        /// File.
        path: PathBuf,
        /// What the painter said.
        reason: String,
    },
    /// Values do not fill the grid they are said to fill.
    #[error("{path}: {len} values do not fill {rows} × {cols} cells", path = path.display())]
    Shape {
        /// File.
        path: PathBuf,
        /// Number of values, or of colour bytes.
        len: usize,
        /// Rows of the grid.
        rows: usize,
        /// Columns of the grid, or colour bytes in a row.
        cols: usize,
    },
}

impl FigureError {
    /// The same error with `place` of its path.
    #[must_use]
    pub fn relocated(self, place: &dyn Fn(&Path) -> PathBuf) -> Self {
        match self {
            Self::Output(error) => Self::Output(error.relocated(place)),
            Self::Io { path, source } => Self::Io {
                path: place(&path),
                source,
            },
            Self::Paint { path, reason } => Self::Paint {
                path: place(&path),
                reason,
            },
            Self::Shape { path, len, rows, cols } => Self::Shape {
                path: place(&path),
                len,
                rows,
                cols,
            },
        }
    }
}
