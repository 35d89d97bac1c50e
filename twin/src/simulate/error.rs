//! Why a scene was not simulated.

use crate::chain::TwinError;
use spts_sim::scene::SceneError;
use std::path::{Path, PathBuf};

/// A simulation that could not start or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Mechanics, transducer or readout failed.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// Neither a known scene nor a scene file.
    #[error("SCENE = \"{name}\" is not press/NAME, press with --mesh, bounce, or a file that ends in .toml")]
    UnknownScene {
        /// What was asked for.
        name: String,
    },
    /// An option that does not go with the scene.
    #[error("{option} = {value}: {reason}")]
    Option {
        /// Option, with its dashes.
        option: &'static str,
        /// Its value.
        value: String,
        /// Why it cannot be used.
        reason: &'static str,
    },
    /// A file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// A file is not TOML, or has a key or a value that does not belong there.
    #[error("{}, line {line}: {message} (`{text}`)", path.display())]
    Parse {
        /// File.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
        /// The line's text.
        text: String,
    },
    /// A readout profile with a value that cannot be used.
    #[error("{}: {source}", path.display())]
    InProfile {
        /// File.
        path: PathBuf,
        /// What is wrong.
        source: Box<TwinError>,
    },
    /// More values than a run may hold.
    #[error("{what} = {values} is outside [1, {most}]")]
    TooLarge {
        /// What makes up the number.
        what: &'static str,
        /// Number of values.
        values: usize,
        /// Most values allowed.
        most: usize,
    },
}

impl SimulateError {
    /// What the TOML reader found in `text`, on one line.
    pub(super) fn parse(path: &Path, text: &str, error: &toml::de::Error) -> Self {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let before = text.get(..start).unwrap_or_default();
        let line = before.matches('\n').count();
        Self::Parse {
            path: path.to_owned(),
            line: line + 1,
            message: error.message().trim_end().replace('\n', "; "),
            text: text.lines().nth(line).unwrap_or_default().trim().to_owned(),
        }
    }
}
