//! A command line that cannot be used, on one line: option, value and valid range, as for a field of a scene.

use super::extras::COMMANDS_ELSEWHERE;
use super::terminal::one_line;
use clap::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error as _;

/// What is wrong with the command line; `None` when the user asked for help or for the version, which are printed as
/// they are.
#[must_use]
pub fn refusal(error: &Error) -> Option<String> {
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
            let reason = error.source().map(ToString::to_string).unwrap_or_default();
            Some(format!("`{option}` = {value}{}", joined(&reason)))
        }
        _ => {
            let said = error.render().to_string();
            let (said, usage) = said.split_once("\n\nUsage: ").unwrap_or((&said, ""));
            let said = said.split("\n\nFor more information").next().unwrap_or_default();
            let said = said.strip_prefix("error: ").unwrap_or(said);
            let said = one_line(said).replace(":; ", ": ");
            let elsewhere = match error.kind() {
                // of `spts` itself, and not of a command that is here
                ErrorKind::InvalidSubcommand if usage.starts_with("spts <") || usage.starts_with("spts [") => {
                    COMMANDS_ELSEWHERE
                }
                _ => "",
            };
            Some(format!("{said}{elsewhere}"))
        }
    }
}

/// `--threads` of `--threads <N>`.
fn option_name(argument: &str) -> &str {
    argument.split([' ', '=']).next().unwrap_or(argument)
}

/// The reason as it follows a value: " is outside [1, 9]", or ": two numbers are needed".
fn joined(reason: &str) -> String {
    if reason.starts_with("is ") {
        format!(" {reason}")
    } else {
        format!(": {reason}")
    }
}
