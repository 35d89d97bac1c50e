//! Errors of row design.

use crate::checks::RangeError;
use crate::recover::PriorError;

/// Why rows cannot be designed or selected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RowError {
    /// A parameter is outside its range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// More rows are requested than exist.
    #[error("`rows` = {rows} is outside [1, {most}]: {reason}")]
    Rows {
        /// Requested number of rows.
        rows: usize,
        /// Largest possible number of rows.
        most: usize,
        /// Reason for the limit.
        reason: &'static str,
    },
    /// The expected images do not fit the grid.
    #[error("images of {pixels} taxels on a grid of {rows} × {cols}")]
    Shape {
        /// Taxels of the images.
        pixels: usize,
        /// Rows of the grid.
        rows: usize,
        /// Columns of the grid.
        cols: usize,
    },
    /// The designer needs classes to distinguish.
    #[error("`classes` has {labels} classes; rows that tell classes apart need at least 2")]
    Classes {
        /// Number of different labels.
        labels: usize,
    },
    /// No row respects the headroom.
    #[error(
        "no row of levels ±1 has a sum below `largest_sum` = {limit:.3} of a random row's; the smallest has {least:.3}"
    )]
    Headroom {
        /// The limit, relative to a random row's root mean square.
        limit: f64,
        /// The smallest value found.
        least: f64,
    },
    /// Images from which no Gaussian prior can be made.
    #[error(transparent)]
    Prior(#[from] PriorError),
}
