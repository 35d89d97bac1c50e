//! What can be wrong with a directory of recordings.

use crate::session::SessionError;
use std::path::PathBuf;

/// A recording that cannot be used. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// The file system said no.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A file that others need is not there.
    #[error("{path}: missing; {needed_by} needs it", path = path.display())]
    Missing {
        /// File.
        path: PathBuf,
        /// What cannot be used without it.
        needed_by: String,
    },
    /// Not a MATLAB v5 file, or a damaged one.
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
    /// A variable that is no array of numbers.
    #[error("{path}: variable `{name}` is a {class}; expected an array of numbers", path = path.display())]
    NotNumeric {
        /// File.
        path: PathBuf,
        /// Variable.
        name: &'static str,
        /// Its class, in MATLAB's words.
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
        /// What it should be.
        expected: &'static str,
    },
    /// A value outside its range.
    #[error("{path}: `{name}`[{index}] = {value} is outside {range}", path = path.display())]
    Value {
        /// File.
        path: PathBuf,
        /// Variable.
        name: &'static str,
        /// 0-based position.
        index: usize,
        /// The value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
    /// The folder of a session cannot be used.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The numbers do not make a recording.
    #[error("{path}: {source}", path = path.display())]
    Recording {
        /// File.
        path: PathBuf,
        /// Cause.
        source: spts_circuit::RecordingError,
    },
    /// A session that the scores cannot be computed from.
    #[error("{path}: session {session}: `{field}` = {value}; scoring needs {needed}", path = path.display())]
    Unscorable {
        /// Folder of the recordings.
        path: PathBuf,
        /// Name of the session, and the mode of its recording.
        session: String,
        /// What is not enough.
        field: &'static str,
        /// How much there is.
        value: String,
        /// How much is needed.
        needed: String,
    },
    /// A session that no readout can be fitted to.
    #[error("{path}: {session} session: `{field}` = {value}; calibration needs {needed}", path = path.display())]
    Unfit {
        /// Folder of the recordings.
        path: PathBuf,
        /// Session and mode.
        session: String,
        /// What is not as needed.
        field: &'static str,
        /// What it is.
        value: String,
        /// What it must be.
        needed: String,
    },
    /// Nothing to calibrate from.
    #[error("{path}: no session of presses has a compressive recording; calibration needs one", path = path.display())]
    NoCompressive {
        /// Folder of the recordings.
        path: PathBuf,
    },
    /// Two sessions that nothing tells apart.
    #[error("{} and {}: `name` = {name:?} of both sessions; valid: names that differ", first.display(), second.display())]
    SameName {
        /// Folder of one of them.
        first: PathBuf,
        /// Folder of the other.
        second: PathBuf,
        /// Their name, or what is made of their folders where names repeat.
        name: String,
    },
    /// The folder holds no recording at all.
    #[error("{path}: no recordings found; expected session.json, folders with one, or the published recordings (presses/NAME/NAME_raster.mat, Measurements_Collected/NAME/NAME_raster.mat, or a clone of their repository)", path = path.display())]
    NothingFound {
        /// Folder.
        path: PathBuf,
    },
}
