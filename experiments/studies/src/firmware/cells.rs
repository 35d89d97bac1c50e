//! Which cells are emulated, how, and for how long.

use super::error::{CellFailure, FirmwareError};
use super::task::CellTask;
use spts::chain::{RASTER_PERIOD, bus};
use spts_circuit::{Seeding, WeightMode, Weights};
use spts_firmware::attiny412::Device;
use spts_firmware::{Array, Clock, Image};
use std::path::Path;

/// Emulated cells, their clock, and for how long they run.
#[derive(Debug, Clone)]
pub struct EmulatedCells {
    /// Name of the image.
    pub image_name: String,
    /// The image of the cells.
    pub image: Image,
    /// Cells on the bus; [1, 112].
    pub cells: usize,
    /// Number of edges in every mode.
    pub edges: u64,
    /// Tasks of the cells, one after another.
    pub tasks: Vec<CellTask>,
    /// Seeds of the cells: one byte as in the publication, or 32 bits by the extended command.
    pub seeding: Seeding,
    /// Clock.
    pub clock: Clock,
}

/// The image called `name`: `shipped`, `plain`, or a file in Intel's hex format.
///
/// # Errors
/// [`FirmwareError::Image`] if there is none.
pub fn image(name: &str) -> Result<Image, FirmwareError> {
    match name {
        "shipped" => Ok(Image::shipped()),
        "plain" => Ok(Image::plain()),
        file => Ok(Image::read(Path::new(file))?),
    }
}

impl EmulatedCells {
    /// The twin's weights of these cells. The firmware's raster counts to a hundred, however many cells there are.
    pub(super) fn expected_weights(&self, task: CellTask) -> Result<Weights, FirmwareError> {
        let taxels = match task {
            CellTask::Mode(WeightMode::Raster) => RASTER_PERIOD,
            _ => self.cells,
        };
        task.weights(self.seeding, taxels).map_err(|e| self.unusable(e))
    }

    /// Cells that have just been powered up and seeded.
    ///
    /// # Errors
    /// [`FirmwareError`] when there are too many, or one does not answer.
    pub(super) fn started(&self, task: CellTask) -> Result<Array, FirmwareError> {
        bus(&self.expected_weights(task)?, 0, self.cells, &self.image).map_err(|e| self.unusable(e))
    }

    /// What is wrong with these cells, as an error.
    pub(super) fn unusable(&self, failure: impl Into<CellFailure>) -> FirmwareError {
        FirmwareError::Cells {
            image: self.image_name.clone(),
            failure: failure.into(),
        }
    }

    /// The cell of `taxel`, just started.
    ///
    /// # Errors
    /// [`FirmwareError`] when there is no such taxel or a cell does not answer.
    pub(super) fn cell(&self, task: CellTask, taxel: usize) -> Result<Device, FirmwareError> {
        let cell = self.started(task)?.cells().get(taxel).cloned();
        cell.ok_or_else(|| self.no_such(taxel))
    }

    /// A taxel that these cells do not have, as an error.
    pub(super) fn no_such(&self, taxel: usize) -> FirmwareError {
        FirmwareError::NoTaxel {
            taxel,
            last: self.cells.saturating_sub(1),
        }
    }
}
