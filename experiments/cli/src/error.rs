//! Why a command failed.

use spts_input::Refusal;
use std::error::Error;

/// Why a command failed: one clear message, and an exit status.
#[derive(Debug)]
#[non_exhaustive]
pub enum CliError {
    /// An option, a file or the machine stands in the way.
    Refused(Refusal),
    /// What was checked is not so: the command did its work, and the answer is no.
    Differs(String),
}

impl CliError {
    /// What is not usable, in words.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::Refused(Refusal::new(message))
    }

    /// Exit status: 1 when a check says no, 2 for every error, as for a usage error.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Differs(_) => 1,
            Self::Refused(_) => 2,
        }
    }
}

impl std::fmt::Display for CliError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Differs(message) => f.write_str(message),
            Self::Refused(refusal) => refusal.fmt(f),
        }
    }
}

/// Errors of all libraries are shown as they are.
impl<E: Error + Send + Sync + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        Self::Refused(Refusal::from_error(error))
    }
}
