//! Errors of session folders.

use crate::output::OutputError;
use std::path::PathBuf;

/// A session that cannot be read or written. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The file system reports an error.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A version of the schema that this program cannot read.
    #[error("{path}: `schema` = {found} is not known; this program reads {known}", path = path.display())]
    Schema {
        /// File.
        path: PathBuf,
        /// Version in the file.
        found: u64,
        /// Versions that can be read.
        known: &'static str,
    },
    /// A file that does not describe a session.
    #[error("{path}: {reason}", path = path.display())]
    Text {
        /// File.
        path: PathBuf,
        /// The cause, with line and column.
        reason: String,
    },
    /// A field outside its range.
    #[error("{path}: `{field}` = {value} is outside {range}", path = path.display())]
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
    /// A file that is not a NumPy array, or is damaged.
    #[error("{path}: not a readable NumPy array ({reason})", path = path.display())]
    NotNpy {
        /// File.
        path: PathBuf,
        /// What the reader found.
        reason: String,
    },
    /// An array whose shape differs from that in `session.json`.
    #[error("{path}: shape {found:?}; expected {expected:?} ({dimensions})", path = path.display())]
    Shape {
        /// File.
        path: PathBuf,
        /// Its shape.
        found: Vec<usize>,
        /// Expected shape.
        expected: Vec<usize>,
        /// Meaning of the dimensions.
        dimensions: &'static str,
    },
    /// A code that the converter cannot produce.
    #[error("{path}: entry {index} is {code}; the converter has the codes 0 to {max_code}, and {missing} marks a missing sample", path = path.display())]
    Code {
        /// File.
        path: PathBuf,
        /// Index in C order.
        index: usize,
        /// The code.
        code: u32,
        /// Largest code of the converter.
        max_code: u32,
        /// Code that marks a missing sample.
        missing: u32,
    },
    /// A pressure or conductance outside its range.
    #[error("{path}: entry {index} (in C order, from 0) is {value}, outside [0, ∞); NaN marks a map that is not known and then fills all of it", path = path.display())]
    Truth {
        /// File.
        path: PathBuf,
        /// Index in C order.
        index: usize,
        /// The value, Pa or S.
        value: f64,
    },
    /// Numbers that are not a valid recording.
    #[error("{path}: `{mode}`: {source}", path = path.display())]
    Recording {
        /// File.
        path: PathBuf,
        /// Which of the two recordings.
        mode: &'static str,
        /// Cause.
        source: spts_input::Refusal,
    },
    /// The folder cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
