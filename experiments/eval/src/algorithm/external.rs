//! What goes wrong with programs outside.

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
    /// The file of answers that the command should have written is missing or not as documented.
    #[error("`{command}` wrote no valid answers: {}: {source}", path.display())]
    AnswersFile {
        /// The command.
        command: String,
        /// The file.
        path: PathBuf,
        /// Why.
        source: Arc<std::io::Error>,
    },
    /// The command cannot be started or its pipe broke.
    #[error("`{command}`: {source}")]
    Pipe {
        /// The command.
        command: String,
        /// Why.
        source: Arc<std::io::Error>,
    },
    /// The command ended, or closed one of its pipes, before it had answered.
    #[error("`{command}` {how} before it had answered {waited}")]
    Ended {
        /// The command.
        command: String,
        /// Its end: with its exit status, or the pipe that it closed.
        how: String,
        /// What it should have answered.
        waited: String,
    },
    /// The command failed after it had answered everything.
    #[error("`{command}` ended with an error ({status}) after its last answer; its answers are not scored")]
    Status {
        /// The command.
        command: String,
        /// Its exit status.
        status: String,
    },
    /// The command took longer than it may.
    #[error("`{command}` was ended: {waited} took longer than the limit of {} s", limit.as_secs_f64())]
    Late {
        /// The command.
        command: String,
        /// What was waited for.
        waited: String,
        /// The limit.
        limit: Duration,
    },
    /// The command answered what it had not been asked.
    #[error(
        "`{command}` wrote line {line} of its output before it had read window {line} ({asked} windows had been asked); it needs one line a window, written after the window was read"
    )]
    Surplus {
        /// The command.
        command: String,
        /// Number of the line, from 1.
        line: usize,
        /// Windows that had been asked.
        asked: usize,
    },
    /// An algorithm that is no program failed.
    #[error("{name}: {problem}")]
    Failed {
        /// Name of the algorithm.
        name: String,
        /// What went wrong.
        problem: String,
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
