//! Errors of arrays.

use super::bus::BusError;
use crate::avr::ProgramError;

/// Why an array cannot be built or run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// No cell, or more cells than addresses.
    #[error("{cells} cells do not fit on one bus; the range is [1, 112]")]
    Cells {
        /// Number of cells.
        cells: usize,
    },
    /// The number of seeds differs from that of the cells.
    #[error("{seeds} seeds for {cells} cells")]
    Seeds {
        /// Seeds given.
        seeds: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// The number of patterns differs from that of the cells.
    #[error("{patterns} patterns for {cells} cells")]
    Patterns {
        /// Patterns given.
        patterns: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// The number of codes is not a multiple of the number of cells.
    #[error("`codes` has {codes} entries, which is no multiple of the {cells} cells")]
    Codes {
        /// Entries given.
        codes: usize,
        /// Cells of the array.
        cells: usize,
    },
    /// A clock out of range.
    #[error("`{field}` = {value} is outside {range}")]
    Clock {
        /// Field of [`Clock`](super::Clock).
        field: &'static str,
        /// Its value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
    /// A duration out of range.
    #[error("`time_s` = {time_s} is outside [0, 86400] s")]
    Idle {
        /// Duration, s.
        time_s: f64,
    },
    /// The image does not fit into flash.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A transaction failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}
