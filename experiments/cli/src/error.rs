//! One error for the command line: every cause ends in one clear message and an exit status.

use spts::data::DataError;
use spts::output::OutputError;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// A recording cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A study cannot be made.
    #[error(transparent)]
    Study(Box<dyn std::error::Error + Send + Sync>),
    /// An option or a file's content is not usable.
    #[error("{0}")]
    Usage(String),
    /// What was checked is not so: the command did its work, and the answer is no.
    #[error("{0}")]
    Differs(String),
}

/// Errors of the scores and studies, which are shown as they are.
macro_rules! studies {
    ($($error:ty),* $(,)?) => {
        $(impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                Self::Study(Box::new(error))
            }
        })*
    };
}

studies!(
    spts::device::DeviceError,
    spts::device::HostError,
    spts_dataset::DatasetError,
    spts_dataset::SpecError,
    spts_eval::ScoreError,
    spts_eval::decode::DecodeSessionError,
);
#[cfg(feature = "full")]
studies!(
    spts::TwinError,
    spts::simulate::SimulateError,
    spts_live::LiveError,
    spts_report::ReportError,
    spts_report::design::DesignFolderError,
    spts_report::figures::FigureError,
    spts_report::reproduce::ReproduceError,
    spts_report::simulation::SimulationWriteError,
    spts_studies::budget::BudgetError,
    spts_studies::calibrate::CalibrateError,
    spts_studies::compare::CompareError,
    spts_studies::arm::ArmError,
    spts_studies::per_object::PerObjectError,
    spts_studies::design::DesignError,
    spts_studies::electronics::ElectronicsError,
    spts_studies::explore::ExploreError,
    spts_studies::fidelity::FidelityError,
    spts_studies::firmware::FirmwareError,
    spts_studies::readouts::ReadoutsError,
    spts_studies::phase::PhaseError,
    spts_studies::seeds::SeedError,
    spts_studies::sensing::SensingError,
);

impl CliError {
    /// Exit status: 1 when a check says no, 2 for every error, as for a usage error.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Differs(_) => 1,
            _ => 2,
        }
    }
}
