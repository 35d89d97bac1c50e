//! Which cells are run, how, and for how long.

use crate::cli::CliError;
use crate::twin::{RASTER_PERIOD, bus};
use spts_circuit::{Seeding, WeightMode, Weights};
use spts_firmware::attiny412::Device;
use spts_firmware::{Array, Clock, Image};
use std::path::Path;

/// A run of emulated cells.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the image.
    pub image_name: String,
    /// What the cells run.
    pub image: Image,
    /// Cells on the bus; [1, 112].
    pub cells: usize,
    /// Edges in every mode.
    pub edges: u64,
    /// Modes, one after another.
    pub modes: Vec<WeightMode>,
    /// Seeds of the cells: one byte as published, or 32 bits by the extended command.
    pub seeding: Seeding,
    /// Clock.
    pub clock: Clock,
}

/// The image called `name`: `shipped`, `plain`, or a file in Intel's hex format.
///
/// # Errors
/// [`CliError::Usage`] when there is none.
pub fn image(name: &str) -> Result<Image, CliError> {
    match name {
        "shipped" => Ok(Image::shipped()),
        "plain" => Ok(Image::plain()),
        file => Image::read(Path::new(file))
            .map_err(|e| CliError::Usage(format!("`--image`: {e}; valid: shipped, plain, or a hex file"))),
    }
}

impl Plan {
    /// The twin's weights of these cells. The firmware's raster counts to a hundred, however many cells there are.
    pub(super) fn weights(&self, mode: WeightMode) -> Weights {
        let taxels = match mode {
            WeightMode::Raster => RASTER_PERIOD,
            _ => self.cells,
        };
        Weights::new(mode, self.seeding, u32::try_from(taxels).unwrap_or(u32::MAX))
    }

    /// Cells that have just been powered up and seeded.
    ///
    /// # Errors
    /// [`CliError::Usage`] when there are too many, or one does not answer.
    pub(super) fn started(&self, mode: WeightMode) -> Result<Array, CliError> {
        bus(&self.weights(mode), 0, self.cells, &self.image).map_err(|e| self.unusable(&e))
    }

    /// What is wrong with the cells of this plan, as an error.
    pub(super) fn unusable(&self, reason: &dyn std::fmt::Display) -> CliError {
        CliError::Usage(format!("image {}: {reason}", self.image_name))
    }
}

impl Plan {
    /// The cell of `taxel`, seeded in `mode`.
    ///
    /// # Errors
    /// [`CliError::Usage`] when there is no such taxel or a cell does not answer.
    pub(super) fn cell(&self, mode: WeightMode, taxel: usize) -> Result<Device, CliError> {
        let cell = self.started(mode)?.cells().get(taxel).cloned();
        cell.ok_or_else(|| self.no_such(taxel))
    }

    /// A taxel that these cells do not have, as an error.
    pub(super) fn no_such(&self, taxel: usize) -> CliError {
        let last = self.cells.saturating_sub(1);
        CliError::Usage(format!("taxel {taxel} is outside [0, {last}]"))
    }
}
