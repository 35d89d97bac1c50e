//! One error for the command line: every cause ends in one clear message and exit status 2.

use crate::data::DataError;
use crate::output::OutputError;
use crate::simulate::SimulateError;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// A recording cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A scene cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The twin cannot be run.
    #[error(transparent)]
    Twin(#[from] crate::twin::TwinError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] crate::figures::FigureError),
    /// An option or a file's content is not usable.
    #[error("{0}")]
    Usage(String),
}
