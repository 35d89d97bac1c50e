//! The `spts` command line.

use clap::Parser as _;
use spts_cli::Cli;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            spts_cli::note(&format!("error: {}", one_line(&e.to_string())));
            ExitCode::from(e.status())
        }
    }
}

/// An error on one line, whatever a library put into it.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}
