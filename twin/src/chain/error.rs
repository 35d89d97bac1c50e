//! Errors of the chain from transducer to recording.

use spts_input::Refusal;
use spts_models::{TransducerError, in_section};
use std::path::{Path, PathBuf};

/// A transducer, readout or source of weights that cannot be used, or a recording that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// No transducer of that name.
    #[error("`transducer` = \"{name}\" is not a transducer; known: {known}")]
    UnknownTransducer {
        /// Name asked for.
        name: String,
        /// All known names.
        known: String,
    },
    /// Parameters that the transducer refuses. The message names the field.
    #[error("{0}")]
    Transducer(String),
    /// No readout profile of that name.
    #[error("`readout` = \"{name}\" is not a readout profile; known: {known}")]
    UnknownProfile {
        /// Name asked for.
        name: String,
        /// All known names.
        known: String,
    },
    /// A readout profile that cannot be used. The message names the field and, if the profile is a file, the file.
    #[error("{0}")]
    Profile(String),
    /// Rows of the sensing matrix that are not valid. The message names the field and, if there is one, the file.
    #[error("{0}")]
    Rows(String),
    /// A file of seeds or of a pattern cannot be read.
    #[error("`rows.{field}`: {path}: {source}", path = path.display())]
    RowsFile {
        /// Key of the scene that names the file.
        field: &'static str,
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A fault of the scene that cannot be injected: the message names the field.
    #[error("{0}")]
    Fault(String),
    /// A source of weights that the table does not list.
    #[error("`weights` = \"{name}\" is not a source of weights; known: {known}")]
    UnknownWeights {
        /// Name in the scene.
        name: String,
        /// All known names.
        known: String,
    },
    /// The weights cannot come from the firmware.
    #[error("`weights` = \"firmware\": {0}")]
    Cells(#[from] super::CellsError),
    /// A file of gains cannot be used.
    #[error("`gains`: {path}: {reason}", path = path.display())]
    Gains {
        /// File.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A profile file cannot be read.
    #[error("`readout`: {path}: {source}", path = path.display())]
    Io {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The readout cannot be set up, or could not make the recording.
    #[error("readout: {0}")]
    Readout(#[from] Refusal),
    /// A conductance that the readout cannot use.
    #[error("conductance: {0}")]
    Source(#[source] Refusal),
    /// A press that is too long to record.
    #[error("`duration_s` = {duration_s}: {measurements:.0} measurements a press are outside [1, {limit:.0}]")]
    TooLong {
        /// Length of the press, s.
        duration_s: f64,
        /// Number of its measurements.
        measurements: f64,
        /// Largest number of measurements in a press.
        limit: f64,
    },
}

impl ChainError {
    /// What the transducer called `name` refuses.
    pub(super) fn transducer(name: &str, error: &TransducerError) -> Self {
        match error {
            TransducerError::Unknown { name, known } => Self::UnknownTransducer {
                name: name.clone(),
                known: known.clone(),
            },
            other => {
                let message = in_section("transducer_parameters", &other.to_string());
                Self::Transducer(format!("{message} (transducer `{name}`)"))
            }
        }
    }

    /// What is wrong with the readout profile, which is in the file `path` unless it goes by a name.
    pub(super) fn profile(path: Option<&Path>, error: &Refusal) -> Self {
        let message = in_section("readout", &error.to_string());
        Self::Profile(match path {
            Some(path) => format!("{}: {message}", path.display()),
            None => message,
        })
    }
}
