//! The `spts` command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(spts_cli::main_with(std::env::args_os()))
}
