//! Commands that need the physics engine, the studies or the figures.

use crate::context::progress;
use crate::error::CliError;
use crate::{
    budget, calibrate, circuit, compare, design, explore, fidelity, firmware, live, readouts, reproduce, sensing,
    simulate, validate,
};
use clap::Subcommand;
use spts_contact::objects::OBJECTS;
use spts_eval::training::Skins;
use spts_eval::{ScoredSession, Source, TwinSessions};
use spts_models::SkinLayout;

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

pub(crate) use spts_report::decode::write as write_decoded;
pub(crate) use spts_report::score::{write as write_board, write_anytime, write_in_time};

/// Where the commands are that this program lacks: it has all.
pub(crate) const COMMANDS_ELSEWHERE: &str = "";

/// Sessions of `scenes`, simulated now.
pub(crate) fn simulated_sessions(scenes: &[String], seed: u64, quick: bool) -> Result<Source, CliError> {
    let scenes = scenes.to_vec();
    let twin = TwinSessions { scenes, seed, quick };
    let bar = progress(twin.steps(), "simulating presses");
    let set = twin.simulate(&|| bar.inc(1));
    bar.finish_and_clear();
    Ok(Source::new(set?)?)
}

/// Simulated presses of every object on as many skins as the default says, made once for all sources that need them.
/// The skins have the `layout` of the scored one, and usual gains; with `median`, gain 1 everywhere.
pub(crate) fn simulated_presses(layout: SkinLayout, median: bool, seed: u64) -> Result<Vec<ScoredSession>, CliError> {
    let skins = if median {
        Skins::median(layout)
    } else {
        Skins {
            layout,
            ..Skins::default()
        }
    };
    let bar = progress(skins.skins * OBJECTS.len(), "simulated presses");
    let sessions = skins.press(seed, &|| bar.inc(1));
    bar.finish_and_clear();
    sessions.map_err(|e| CliError::usage(format!("simulated presses: {e}")))
}
