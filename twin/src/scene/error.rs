//! Why a scene is not valid.

use super::SceneConfig;
use crate::chain::ChainError;
use spts_sim::mechanics::MechanicsError;
use std::path::{Path, PathBuf};

/// Characters of a wrong line that an error repeats: a line of any file of ours is shorter.
const SHOWN: usize = 120;

/// A scene that cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The error, with the file it is in.
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
    /// The text is not TOML, or has a key or a value that does not belong there.
    #[error("line {line}: {message} (`{text}`)")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
        /// The line's text.
        text: String,
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
    /// The session that is recorded cannot be called so.
    #[error("`name` = {value:?} is outside {range}")]
    Name {
        /// The name.
        value: String,
        /// Valid names.
        range: &'static str,
    },
    /// What happens on the skin is not valid.
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
    pub(crate) fn parse(text: &str, error: &toml::de::Error) -> Self {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let before = text.get(..start).unwrap_or_default();
        let line = before.matches('\n').count();
        Self::Parse {
            line: line + 1,
            message: error.message().trim_end().replace('\n', "; "),
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
    /// What `text` writes.
    ///
    /// # Errors
    /// [`SceneError::Parse`] with the line.
    pub fn from_toml(text: &str) -> Result<Self, SceneError> {
        toml::from_str(text).map_err(|error| SceneError::parse(text, &error))
    }
}
