//! The commands of `spts`.

#[cfg(feature = "full")]
mod bench;
#[cfg(feature = "full")]
mod budget;
#[cfg(feature = "full")]
mod calibrate;
#[cfg(feature = "full")]
mod circuit;
#[cfg(feature = "full")]
mod compare;
mod context;
mod dataset;
mod decode;
#[cfg(feature = "full")]
mod design;
mod device;
mod error;
#[cfg(feature = "full")]
mod fidelity;
#[cfg(feature = "full")]
mod firmware;
#[cfg(feature = "full")]
mod full;
mod import;
#[cfg(feature = "full")]
mod live;
#[cfg_attr(not(feature = "full"), expect(dead_code, reason = "some belong to commands that are left out"))]
mod options;
mod record;
#[cfg(feature = "full")]
mod reproduce;
mod score;
#[cfg(feature = "full")]
mod sensing;
#[cfg(feature = "full")]
mod simulate;
#[cfg(feature = "full")]
mod validate;
#[cfg(feature = "full")]
mod wire;
#[cfg(not(feature = "full"))]
mod without;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
pub use context::{Bars, Common, note, note_error};
pub use error::{CliError, refusal};
#[cfg(feature = "full")]
use full as extras;
use std::ffi::OsString;
use std::io::IsTerminal as _;
#[cfg(not(feature = "full"))]
use without as extras;

/// Digital twin of the single-pixel tactile skin: simulate contacts, record them through the one-wire readout,
/// reconstruct and score them beside recordings of the real skin.
#[derive(Debug, Parser)]
#[command(name = "spts", version, propagate_version = true, max_term_width = WIDTH)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Makes the list of commands, and runs the one that was asked for.
macro_rules! commands {
    ($($(#[$when:meta])? $name:ident($command:ty),)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $($(#[$when])? $name($command),)*
        }

        impl Command {
            fn run(self) -> Result<(), CliError> {
                match self {
                    $($(#[$when])? Self::$name(command) => command.run(),)*
                }
            }
        }
    };
}

// in the order of the help; those behind a feature need the physics engine, the studies or the figures
commands! {
    #[cfg(feature = "full")]
    Simulate(Box<simulate::SimulateCommand>),
    #[cfg(feature = "full")]
    Validate(validate::ValidateCommand),
    #[cfg(feature = "full")]
    Reproduce(reproduce::ReproduceCommand),
    #[cfg(feature = "full")]
    Fidelity(fidelity::FidelityCommand),
    #[cfg(feature = "full")]
    Calibrate(calibrate::CalibrateCommand),
    #[cfg(feature = "full")]
    Compare(compare::CompareCommand),
    #[cfg(feature = "full")]
    Bench(bench::BenchCommand),
    #[cfg(feature = "full")]
    Budget(budget::BudgetCommand),
    #[cfg(feature = "full")]
    Circuit(circuit::CircuitCommand),
    #[cfg(feature = "full")]
    Design(Box<design::DesignCommand>),
    #[cfg(feature = "full")]
    Firmware(firmware::FirmwareCommand),
    #[cfg(feature = "full")]
    Live(live::LiveCommand),
    #[cfg(feature = "full")]
    Sensing(Box<sensing::SensingCommand>),
    Import(import::ImportCommand),
    #[cfg(feature = "full")]
    Wire(wire::WireCommand),
    Decode(decode::DecodeCommand),
    Score(score::ScoreCommand),
    Dataset(dataset::DatasetCommand),
    Device(device::DeviceCommand),
    Record(record::RecordCommand),
}

/// Most columns of a line of help.
const WIDTH: usize = 120;

/// Exit status for a command line that cannot be used.
const REFUSED: u8 = 2;

/// Runs the program with these `arguments`, the first of which is its own name; its exit status.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let command = match Cli::from_arguments(arguments) {
        Ok(command) => command,
        Err(error) => {
            if let Some(reason) = refusal(&error) {
                note_error(&reason);
                return REFUSED;
            }
            // help and version; a reader that went away is no error
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(REFUSED);
        }
    };
    match command.run() {
        Ok(()) => 0,
        Err(error) => {
            note_error(&error.to_string());
            error.status()
        }
    }
}

impl Cli {
    /// The command that `arguments` are, the first of which is the program's name.
    ///
    /// # Errors
    /// [`clap::Error`] for help, the version, and a command line that cannot be used ([`refusal`]).
    pub fn from_arguments(arguments: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let command = with_negative_numbers(Self::command());
        let command = if std::io::stdout().is_terminal() {
            command
        } else {
            // help that is written to a file or a pager is as wide as on a wide terminal
            command.term_width(WIDTH)
        };
        let matches = command.try_get_matches_from(arguments)?;
        Self::from_arg_matches(&matches)
    }

    /// Runs the command.
    ///
    /// # Errors
    /// [`CliError`] with a message that names file, field and value.
    pub fn run(self) -> Result<(), CliError> {
        spts::cleanup::end_on_signals().map_err(|e| CliError::usage(format!("signal handlers: {e}")))?;
        self.command.run()
    }
}

/// The command, and all below it, with `-1` as the value of an option, to be refused with the range, and not as an
/// option that does not exist.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    command.allow_negative_numbers(true).mut_subcommands(with_negative_numbers)
}
