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
            spts_experiments::cli::note(&format!("error: {e}"));
            ExitCode::from(FAILED)
        }
    }
}
