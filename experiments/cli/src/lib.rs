//! The commands of `spts`.

mod bench;
mod budget;
mod calibrate;
mod circuit;
mod compare;
mod context;
mod dataset;
mod decode;
mod design;
mod device;
mod error;
mod fidelity;
mod firmware;
mod import;
mod live;
mod options;
mod record;
mod reproduce;
mod score;
mod sensing;
mod simulate;
mod simulated;
mod validate;
mod wire;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
pub use context::{Bars, Common, note, note_error};
pub use error::{CliError, refusal};
use std::ffi::OsString;
use std::io::IsTerminal as _;

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
    ($($name:ident($command:ty),)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $($name($command),)*
        }

        impl Command {
            fn run(self) -> Result<(), CliError> {
                match self {
                    $(Self::$name(command) => command.run(),)*
                }
            }
        }
    };
}

// in the order of the help
commands! {
    Simulate(Box<simulate::SimulateCommand>),
    Validate(validate::ValidateCommand),
    Reproduce(reproduce::ReproduceCommand),
    Fidelity(fidelity::FidelityCommand),
    Calibrate(calibrate::CalibrateCommand),
    Compare(compare::CompareCommand),
    Bench(bench::BenchCommand),
    Budget(budget::BudgetCommand),
    Circuit(circuit::CircuitCommand),
    Design(Box<design::DesignCommand>),
    Firmware(firmware::FirmwareCommand),
    Live(live::LiveCommand),
    Sensing(Box<sensing::SensingCommand>),
    Import(import::ImportCommand),
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
