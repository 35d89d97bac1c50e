//! Errors of emulated cells.

use spts::chain::CellsError;
use spts_circuit::WeightsError;
use spts_firmware::avr::ProgramError;
use spts_firmware::{AddressError, ArrayError, BusError, ImageError};

/// Why emulated cells give no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FirmwareError {
    /// There is no such image, or the file contains none.
    #[error("`--image`: {0}; valid: shipped, plain, or a hex file")]
    Image(#[from] ImageError),
    /// The cells of an image do not work.
    #[error("image {image}: {failure}")]
    Cells {
        /// Name of the image.
        image: String,
        /// The failure.
        #[source]
        failure: CellFailure,
    },
    /// There is no such taxel.
    #[error("taxel {taxel} is outside [0, {last}]")]
    NoTaxel {
        /// Taxel, from 0.
        taxel: usize,
        /// The last one.
        last: usize,
    },
    /// More edges than an array has rows.
    #[error("`--edges`: {0}")]
    Edges(#[from] std::num::TryFromIntError),
}

/// Failure of cells that run an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellFailure {
    /// The array cannot be built or clocked.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// A cell does not answer on the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The image is not a valid program.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// Cells cannot put out these weights.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The weights are not valid.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// No cell has this address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The codes differ from the twin's, even with a slow clock.
    #[error("codes differ from the twin's in {mode} mode; `spts firmware verify` shows which")]
    OtherCodes {
        /// Mode of the cells.
        mode: String,
    },
    /// The code never changes.
    #[error("no new code in {mode} mode")]
    NoNewCode {
        /// Mode of the cells.
        mode: String,
    },
    /// The cell misses edges of every clock.
    #[error("misses edges of any clock in {mode} mode")]
    LosesEdges {
        /// Mode of the cells.
        mode: String,
    },
}
