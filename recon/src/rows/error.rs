//! Why there are no rows.

use crate::checks::RangeError;
use crate::coherence::CoherenceError;
use crate::recover::PriorError;

/// Why rows cannot be designed or chosen.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RowError {
    /// A parameter is outside its range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// More rows are asked for than there are.
    #[error("`rows` = {rows} is outside [1, {most}]: {reason}")]
    Rows {
        /// Rows asked for.
        rows: usize,
        /// Most rows that can be had.
        most: usize,
        /// What limits them.
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
    /// The designer needs classes to tell apart.
    #[error("`classes` has {labels} classes; rows that tell classes apart need at least 2")]
    Classes {
        /// Number of different labels.
        labels: usize,
    },
    /// No row keeps to the headroom.
    #[error("no row of levels ±1 has a sum below {limit:.3} of a random row's; the smallest found has {least:.3}")]
    Headroom {
        /// The limit, as a multiple of a random row's root mean square.
        limit: f64,
        /// The smallest that was found.
        least: f64,
    },
    /// Images that make no Gaussian prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A matrix that cannot be judged.
    #[error(transparent)]
    Coherence(#[from] CoherenceError),
}
