//! The `spts` command line.

use spts_cli::{Cli, note_error, refusal};
use std::process::ExitCode;

/// Exit status for a command line that cannot be used.
const REFUSED: u8 = 2;

fn main() -> ExitCode {
    let command = match Cli::from_command_line() {
        Ok(command) => command,
        Err(error) => match refusal(&error) {
            Some(reason) => {
                note_error(&reason);
                return ExitCode::from(REFUSED);
            }
            // help and version
            None => error.exit(),
        },
    };
    match command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note_error(&error.to_string());
            ExitCode::from(error.status())
        }
    }
}
