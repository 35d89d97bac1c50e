//! The `spts` command line.

use clap::Parser as _;
use spts_experiments::cli::Cli;
use std::process::ExitCode;

/// Status of every error, as for a usage error.
const FAILED: u8 = 2;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            spts_experiments::cli::note(&format!("error: {}", one_line(&e.to_string())));
            ExitCode::from(FAILED)
        }
    }
}

/// An error on one line, whatever a library put into it.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}
