//! Errors of folders with recordings.

use crate::session::SessionError;
use std::path::PathBuf;

/// A recording that cannot be used. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// The file system reports an error.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A required file is missing.
    #[error("{path}: missing; {needed_by} needs it", path = path.display())]
    Missing {
        /// File.
        path: PathBuf,
        /// What cannot be used without it.
        needed_by: String,
    },
    /// A file that is not in MATLAB v5 format, or is damaged.
    #[error("{path}: not a readable MATLAB v5 file ({reason})", path = path.display())]
    NotMat {
        /// File.
        path: PathBuf,
        /// What the reader found.
        reason: String,
    },
    /// A variable is missing.
    #[error("{path}: no variable `{name}` (found: {found})", path = path.display())]
    NoVariable {
        /// File.
        path: PathBuf,
        /// Variable looked for.
        name: &'static str,
        /// Variables in the file, with their classes.
        found: String,
    },
    /// A variable that is not an array of numbers.
    #[error("{path}: variable `{name}` is a {class}; expected an array of numbers", path = path.display())]
    NotNumeric {
        /// File.
        path: PathBuf,
        /// Variable.
        name: &'static str,
        /// Class of the variable, as MATLAB names it.
        class: &'static str,
    },
    /// A variable of the wrong shape.
    #[error("{path}: `{name}` has shape {shape:?}; expected {expected}", path = path.display())]
    Shape {
        /// File.
        path: PathBuf,
        /// Variable.
        name: &'static str,
        /// Its shape.
        shape: Vec<usize>,
        /// Expected shape.
        expected: &'static str,
    },
    /// A value outside its range.
    #[error("{path}: `{name}`[{index}] = {value} is outside {range}", path = path.display())]
    Value {
        /// File.
        path: PathBuf,
        /// Variable.
        name: &'static str,
        /// Position, from 0.
        index: usize,
        /// The value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
    /// A session folder that cannot be used.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Numbers that are not a valid recording.
    #[error("{path}: {source}", path = path.display())]
    Recording {
        /// File.
        path: PathBuf,
        /// Cause.
        source: spts_input::Refusal,
    },
    /// A session that cannot be scored.
    #[error("{path}: session {session}: `{field}` = {value}; scoring needs {needed}", path = path.display())]
    Unscorable {
        /// Folder of the recordings.
        path: PathBuf,
        /// Name of the session and mode of its recording.
        session: String,
        /// The field that is too small.
        field: &'static str,
        /// Its value.
        value: String,
        /// The value that scoring needs.
        needed: String,
    },
    /// A session to which no readout can be fitted.
    #[error("{path}: {session} session: `{field}` = {value}; calibration needs {needed}", path = path.display())]
    Unfit {
        /// Folder of the recordings.
        path: PathBuf,
        /// Name of the session and mode of its recording.
        session: String,
        /// The field that does not fit.
        field: &'static str,
        /// Its value.
        value: String,
        /// The value that calibration needs.
        needed: String,
    },
    /// No recording to calibrate from.
    #[error("{path}: no session of presses has a compressive recording; calibration needs one", path = path.display())]
    NoCompressive {
        /// Folder of the recordings.
        path: PathBuf,
    },
    /// Two sessions of the same name.
    #[error("{} and {}: `name` = {name:?} of both sessions; valid: names that differ", first.display(), second.display())]
    SameName {
        /// Folder of one of them.
        first: PathBuf,
        /// Folder of the other.
        second: PathBuf,
        /// Their name; or, if names repeat, the name made from their folders.
        name: String,
    },
    /// A folder without recordings.
    #[error("{path}: no recordings found; expected session.json, folders with one, or the published recordings (presses/NAME/NAME_raster.mat, Measurements_Collected/NAME/NAME_raster.mat, or a clone of their repository)", path = path.display())]
    NothingFound {
        /// Folder.
        path: PathBuf,
    },
}
