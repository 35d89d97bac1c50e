//! The commands of `spts`.

mod budget;
mod calibrate;
mod circuit;
mod compare;
mod context;
mod dataset;
mod decode;
mod error;
mod explore;
mod fidelity;
mod firmware;
mod options;
mod phase;
mod progress;
mod refusal;
mod reproduce;
mod score;
mod seeds;
mod simulate;
mod terminal;
mod validate;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
pub use context::{Common, note, note_error};
pub use error::CliError;
pub use progress::Bars;
pub use refusal::refusal;

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
    Dataset(dataset::DatasetCommand),
    Firmware(firmware::FirmwareCommand),
    Phase(phase::PhaseCommand),
    Seeds(seeds::SeedsCommand),
}

impl Cli {
    /// The command that the program was started with.
    ///
    /// # Errors
    /// [`clap::Error`] for help, the version, and a command line that cannot be used ([`refusal`]).
    pub fn from_command_line() -> Result<Self, clap::Error> {
        let matches = with_negative_numbers(Self::command()).try_get_matches()?;
        Self::from_arg_matches(&matches)
    }

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
            Command::Dataset(command) => command.run(),
            Command::Firmware(command) => command.run(),
            Command::Phase(command) => command.run(),
            Command::Seeds(command) => command.run(),
        }
    }
}

/// The command, and all below it, with `-1` as the value of an option, to be refused with the range, and not as an
/// option that does not exist.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command
        .allow_negative_numbers(true)
        .mut_subcommands(with_negative_numbers)
}
