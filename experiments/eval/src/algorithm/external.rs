//! Errors of external programs.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Why an external algorithm has no answer.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum ExternalError {
    /// An exchange file cannot be written or read.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Arc<std::io::Error>,
    },
    /// The answers file that the command should have written is missing or not valid.
    #[error("`{command}` wrote no valid answers: {}: {source}", path.display())]
    AnswersFile {
        /// The command.
        command: String,
        /// The file.
        path: PathBuf,
        /// Why.
        source: Arc<std::io::Error>,
    },
    /// The command cannot be started, or its pipe broke.
    #[error("`{command}`: {source}")]
    Pipe {
        /// The command.
        command: String,
        /// Why.
        source: Arc<std::io::Error>,
    },
    /// The command ended, or closed a pipe, before it had answered.
    #[error("`{command}` {how} before it had answered {waited}")]
    Ended {
        /// The command.
        command: String,
        /// How it ended: with its exit status, or the pipe that it closed.
        how: String,
        /// Which answer was missing.
        waited: String,
    },
    /// The command failed after its last answer.
    #[error("`{command}` ended with an error ({status}) after its last answer; its answers are not scored")]
    Status {
        /// The command.
        command: String,
        /// Its exit status.
        status: String,
    },
    /// The command exceeded the time limit.
    #[error("`{command}` was ended: {waited} took longer than the limit of {} s", limit.as_secs_f64())]
    Late {
        /// Which answer was late.
        command: String,
        /// Which answer was late.
        waited: String,
        /// The limit.
        limit: Duration,
    },
    /// The command wrote more answers than it was asked for.
    #[error(
        "`{command}` wrote line {line} of its output before it had read window {line} ({asked} windows had been sent); it must write one line a window, after reading the window"
    )]
    Surplus {
        /// The command.
        command: String,
        /// Number of the line, from 1.
        line: usize,
        /// Number of windows that had been sent.
        asked: usize,
    },
    /// An algorithm inside this program failed.
    #[error("{name}: {problem}")]
    Failed {
        /// Name of the algorithm.
        name: String,
        /// The problem.
        problem: String,
    },
    /// The answer is not valid.
    #[error("`{command}` answered {problem}")]
    Answer {
        /// The command.
        command: String,
        /// The problem with the answer.
        problem: String,
    },
}
