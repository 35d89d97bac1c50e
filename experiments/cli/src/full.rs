//! Commands that need the physics engine, the studies or the figures.

use crate::error::CliError;
use crate::{
    budget, calibrate, circuit, compare, design, explore, fidelity, firmware, live, readouts, reproduce, sensing,
    simulate, validate,
};
use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(super) enum FullCommand {
    Simulate(Box<simulate::SimulateCommand>),
    Validate(validate::ValidateCommand),
    Reproduce(reproduce::ReproduceCommand),
    Fidelity(fidelity::FidelityCommand),
    Calibrate(calibrate::CalibrateCommand),
    Compare(compare::CompareCommand),
    Budget(budget::BudgetCommand),
    Circuit(circuit::CircuitCommand),
    Design(Box<design::DesignCommand>),
    Explore(explore::ExploreCommand),
    Firmware(firmware::FirmwareCommand),
    Live(live::LiveCommand),
    Readouts(readouts::ReadoutsCommand),
    Sensing(Box<sensing::SensingCommand>),
}

impl FullCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Simulate(command) => command.run(),
            Self::Validate(command) => command.run(),
            Self::Reproduce(command) => command.run(),
            Self::Fidelity(command) => command.run(),
            Self::Calibrate(command) => command.run(),
            Self::Compare(command) => command.run(),
            Self::Budget(command) => command.run(),
            Self::Circuit(command) => command.run(),
            Self::Design(command) => command.run(),
            Self::Explore(command) => command.run(),
            Self::Firmware(command) => command.run(),
            Self::Live(command) => command.run(),
            Self::Readouts(command) => command.run(),
            Self::Sensing(command) => command.run(),
        }
    }
}
