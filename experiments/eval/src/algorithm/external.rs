//! What goes wrong with programs outside.

use std::path::PathBuf;

/// Why an external algorithm has no answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExternalError {
    /// An exchange file cannot be written or read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The command cannot be started or its pipe broke.
    #[error("`{command}`: {source}")]
    Pipe {
        /// The command.
        command: String,
        /// Why.
        source: std::io::Error,
    },
    /// The command ended before it had answered.
    #[error("`{command}` ended ({status}) before it had answered")]
    Ended {
        /// The command.
        command: String,
        /// Its exit status.
        status: String,
    },
    /// The command did not answer.
    #[error("`{command}` has not answered a window for {seconds} s (does it flush its output?)")]
    Silent {
        /// The command.
        command: String,
        /// Time waited, s.
        seconds: u64,
    },
    /// The answer is not one.
    #[error("`{command}` answered {problem}")]
    Answer {
        /// The command.
        command: String,
        /// What is wrong with the answer.
        problem: String,
    },
}
