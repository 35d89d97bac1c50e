//! Why a command failed.

use clap::error::{ContextKind, ContextValue, ErrorKind};
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
    /// A signal ended the command, which has left its work in order.
    Stopped {
        /// Number of the signal.
        signal: i32,
        /// What is left of the work.
        message: String,
    },
}

impl CliError {
    /// What is not usable, in words.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::Refused(Refusal::new(message))
    }

    /// Exit status: 1 when a check says no, 128 and the number of a signal, 2 for every error, as for a usage error.
    pub fn status(&self) -> u8 {
        match self {
            Self::Differs(_) => 1,
            Self::Refused(_) => 2,
            Self::Stopped { signal, .. } => u8::try_from(128 + signal).unwrap_or(u8::MAX),
        }
    }
}

impl std::fmt::Display for CliError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Differs(message) | Self::Stopped { message, .. } => f.write_str(message),
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

/// What is wrong with the command line; `None` when the user asked for help or for the version, which are printed as
/// they are.
pub fn refusal(error: &clap::Error) -> Option<String> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            None
        }
        ErrorKind::ValueValidation => {
            let option = option_name(text(ContextKind::InvalidArg).unwrap_or_default());
            let value = text(ContextKind::InvalidValue).unwrap_or_default();
            let value = if value.trim().is_empty() { format!("{value:?}") } else { value.to_owned() };
            let reason = error.source().map(ToString::to_string).unwrap_or_default();
            Some(format!("`{option}` = {value}{}", joined(&reason)))
        }
        _ => {
            let said = error.render().to_string();
            let said = said.split("\n\nUsage: ").next().unwrap_or_default();
            let said = said.split("\n\nFor more information").next().unwrap_or_default();
            let said = said.strip_prefix("error: ").unwrap_or(said);
            Some(one_line(said).replace(":; ", ": "))
        }
    }
}

/// `--threads` of `--threads <N>`.
fn option_name(argument: &str) -> &str {
    argument.split([' ', '=']).next().unwrap_or(argument)
}

/// The reason as it follows a value: " is outside [1, 9]", or ": two numbers are needed".
fn joined(reason: &str) -> String {
    if reason.starts_with("is ") { format!(" {reason}") } else { format!(": {reason}") }
}

/// `text` on one line, whatever a library or a file put into it.
pub(crate) fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    #[test]
    fn one_line_is_one_line() {
        assert_eq!(super::one_line("\n a \n\n  b\r\nc"), "a; b; c");
    }
}
