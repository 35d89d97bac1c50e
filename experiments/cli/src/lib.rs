//! The commands of `spts`.

mod budget;
mod calibrate;
mod circuit;
mod compare;
mod context;
mod decode;
mod error;
mod explore;
mod fidelity;
mod firmware;
mod options;
mod phase;
mod progress;
mod reproduce;
mod score;
mod seeds;
mod simulate;
mod validate;

use clap::{Parser, Subcommand};
pub use context::{Common, note};
pub use error::CliError;
pub use progress::Bars;

/// Digital twin of the single-pixel tactile skin: simulate contacts, record them through the one-wire readout,
/// reconstruct and score them beside recordings of the real skin.
#[derive(Debug, Parser)]
#[command(name = "spts", version, propagate_version = true, max_term_width = 120)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Simulate(Box<simulate::SimulateCommand>),
    Decode(decode::DecodeCommand),
    Validate(validate::ValidateCommand),
    Reproduce(reproduce::ReproduceCommand),
    Fidelity(fidelity::FidelityCommand),
    Calibrate(calibrate::CalibrateCommand),
    Compare(compare::CompareCommand),
    Score(score::ScoreCommand),
    Budget(budget::BudgetCommand),
    Circuit(circuit::CircuitCommand),
    Explore(explore::ExploreCommand),
    Firmware(firmware::FirmwareCommand),
    Phase(phase::PhaseCommand),
    Seeds(seeds::SeedsCommand),
}

impl Cli {
    /// Runs the command.
    ///
    /// # Errors
    /// [`CliError`] with a message that names file, field and value.
    pub fn run(self) -> Result<(), CliError> {
        spts::cleanup::end_on_signals().map_err(|e| CliError::Usage(format!("signal handlers: {e}")))?;
        match self.command {
            Command::Simulate(command) => command.run(),
            Command::Decode(command) => command.run(),
            Command::Validate(command) => command.run(),
            Command::Reproduce(command) => command.run(),
            Command::Fidelity(command) => command.run(),
            Command::Calibrate(command) => command.run(),
            Command::Compare(command) => command.run(),
            Command::Score(command) => command.run(),
            Command::Budget(command) => command.run(),
            Command::Circuit(command) => command.run(),
            Command::Explore(command) => command.run(),
            Command::Firmware(command) => command.run(),
            Command::Phase(command) => command.run(),
            Command::Seeds(command) => command.run(),
        }
    }
}
