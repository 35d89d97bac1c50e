//! Why an array cannot exist or be run.

use super::bus::BusError;
use crate::avr::ProgramError;

/// An array that cannot exist or cannot be run so.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// More cells than addresses, or none.
    #[error("{cells} cells do not fit on one bus; the range is [1, 112]")]
    Cells {
        /// Number asked for.
        cells: usize,
    },
    /// A number of seeds other than that of the cells.
    #[error("{seeds} seeds for {cells} cells")]
    Seeds {
        /// Seeds given.
        seeds: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// A number of patterns other than that of the cells.
    #[error("{patterns} patterns for {cells} cells")]
    Patterns {
        /// Patterns given.
        patterns: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// Codes that are not whole rows.
    #[error("`codes` has {codes} entries, which is no multiple of the {cells} cells")]
    Codes {
        /// Entries given.
        codes: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// A clock that cannot be.
    #[error("`{field}` = {value} is outside {range}")]
    Clock {
        /// Field of [`Clock`](super::Clock).
        field: &'static str,
        /// Its value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
    /// A time that cannot pass.
    #[error("`time_s` = {time_s} is outside [0, 86400]")]
    Idle {
        /// Time asked for (s).
        time_s: f64,
    },
    /// The image does not fit into flash.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A transaction failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}
