//! Errors of scenes.

use super::SceneConfig;
use crate::chain::ChainError;
use spts_models::explain_toml;
use spts_sim::mechanics::MechanicsError;
use std::path::{Path, PathBuf};

/// Characters of a wrong line that an error repeats: a line of any file of ours is shorter.
const SHOWN: usize = 120;

/// A scene that cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// An error, with the file in which it occurred.
    #[error("{}: {source}", path.display())]
    InFile {
        /// Scene file.
        path: PathBuf,
        /// What is wrong.
        source: Box<SceneError>,
    },
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[from] std::io::Error),
    /// Text that is not TOML, or has an unknown key or a wrong value.
    #[error("line {line}: {message} (`{text}`)")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
        /// The line's text.
        text: String,
    },
    /// An unknown key or a wrong value.
    #[error("{message}")]
    Field {
        /// Field, value, and what is valid.
        message: String,
    },
    /// The scene cannot be written as TOML.
    #[error("cannot be written: {0}")]
    Write(#[from] toml::ser::Error),
    /// The name of a file is not valid UTF-8.
    #[error("{}: the name of the file is not valid UTF-8", path.display())]
    NotUtf8 {
        /// The file.
        path: PathBuf,
    },
    /// A name that a session cannot have.
    #[error("`name` = {value:?} is outside {range}")]
    Name {
        /// The name.
        value: String,
        /// Valid names.
        range: &'static str,
    },
    /// The mechanics are not valid.
    #[error(transparent)]
    Mechanics(#[from] MechanicsError),
    /// Transducer, readout or weights are not valid.
    #[error(transparent)]
    Chain(#[from] ChainError),
}

impl SceneError {
    /// The same error, with the file it is in.
    pub(crate) fn in_file(self, path: &Path) -> Self {
        Self::InFile {
            path: path.to_owned(),
            source: Box::new(self),
        }
    }

    /// What the TOML reader found in `text`, on one line.
    fn parse(text: &str, error: &toml::de::Error) -> Self {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let before = text.get(..start).unwrap_or_default();
        let line = before.matches('\n').count();
        // of a text that is TOML the table knows the field, and the text the line
        let table: Result<toml::Table, _> = toml::from_str(text);
        let in_table = table.ok().and_then(|table| table.try_into::<SceneConfig>().err());
        Self::Parse {
            line: line + 1,
            message: explain_toml(in_table.as_ref().unwrap_or(error)),
            text: text
                .lines()
                .nth(line)
                .unwrap_or_default()
                .trim()
                .chars()
                .take(SHOWN)
                .collect(),
        }
    }
}

impl SceneConfig {
    /// The configuration in `table`.
    ///
    /// # Errors
    /// [`SceneError::Field`] for an unknown key or a wrong value.
    pub fn from_table(table: toml::Table) -> Result<Self, SceneError> {
        table.try_into().map_err(|error| SceneError::Field {
            message: explain_toml(&error),
        })
    }

    /// The configuration in the TOML text `text`.
    ///
    /// # Errors
    /// [`SceneError::Parse`], with the line.
    pub fn from_toml(text: &str) -> Result<Self, SceneError> {
        toml::from_str(text).map_err(|error| SceneError::parse(text, &error))
    }
}
