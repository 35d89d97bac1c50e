//! Why emulated cells cannot be run.

use spts::chain::CellsError;
use spts_circuit::WeightsError;
use spts_firmware::avr::ProgramError;
use spts_firmware::{AddressError, ArrayError, BusError, ImageError};

/// Why there is no answer from emulated cells.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FirmwareError {
    /// There is no such image, or the file holds none.
    #[error("`--image`: {0}; valid: shipped, plain, or a hex file")]
    Image(#[from] ImageError),
    /// The cells of an image cannot be used.
    #[error("image {image}: {failure}")]
    Cells {
        /// Name of the image.
        image: String,
        /// What the cells do wrong.
        #[source]
        failure: CellFailure,
    },
    /// A taxel that the cells do not have.
    #[error("taxel {taxel} is outside [0, {last}]")]
    NoTaxel {
        /// Taxel, 0-based.
        taxel: usize,
        /// The last one.
        last: usize,
    },
    /// More edges than an array has rows.
    #[error("`--edges`: {0}")]
    Edges(#[from] std::num::TryFromIntError),
}

/// What cells that run an image do wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellFailure {
    /// The array cannot be built or clocked.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// A cell does not answer on the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The image is no program.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// Cells cannot put out such weights.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// There are no such weights.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// No cell has this address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// Codes that are not the twin's, even under a slow clock.
    #[error("other codes than the twin's in {mode} mode; `spts firmware verify` says which")]
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
    /// No clock is slow enough.
    #[error("loses edges of any clock in {mode} mode")]
    LosesEdges {
        /// Mode of the cells.
        mode: String,
    },
}
