//! Emulated cells against the circuit's weights, code for code.

use super::plan::Plan;
use crate::cli::CliError;
use crate::twin::{RASTER_PERIOD, cell_mode};
use serde::Serialize;
use spts_circuit::WeightMode;
use spts_firmware::{Array, FIRST_ADDRESS, NEUTRAL_CODE, REPLY_BYTES};
use std::time::Instant;

/// Edges between two comparisons: a megabyte of codes and its levels for a hundred cells.
const CHUNK: usize = 4096;

/// The first code that is not the twin's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Mismatch {
    /// Mode of the cells.
    pub mode: WeightMode,
    /// Edge since the seeds were loaded, 0-based.
    pub edge: u64,
    /// Taxel, 0-based.
    pub taxel: usize,
    /// DAC code of the emulated cell.
    pub code: u8,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeVerification {
    /// Mode of the cells.
    pub mode: WeightMode,
    /// Codes that are not the twin's, of cells × edges.
    pub mismatches: u64,
    /// Cells whose mode, state or code, read over the bus at the end, is not what the twin says.
    pub read_back_mismatches: usize,
}

/// All modes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Name of the image.
    pub image: String,
    /// Cells on the bus.
    pub cells: usize,
    /// Clock edges in every mode.
    pub edges: u64,
    /// Rate of the clock, Hz.
    pub edge_hz: f64,
    /// Codes and read-backs that are not the twin's, over all modes.
    pub mismatches: u64,
    /// The first of them.
    pub first_mismatch: Option<Mismatch>,
    /// By mode.
    pub modes: Vec<ModeVerification>,
    /// Instructions that the cells executed.
    pub instructions: u64,
    /// Wall time of the emulation and the comparison, s.
    pub seconds: f64,
    /// Emulated instructions a second, of all threads together.
    pub instructions_per_s: f64,
}

impl Plan {
    /// Runs every mode of the plan and compares. `tick` is called with the number of edges done.
    ///
    /// # Errors
    /// [`CliError::Usage`] when the array cannot be built or a cell does not answer.
    pub fn verify(&self, tick: &dyn Fn(u64)) -> Result<Verification, CliError> {
        let started = Instant::now();
        let (mut modes, mut first_mismatch, mut instructions) = (Vec::new(), None, 0);
        for &mode in &self.modes {
            let mut array = self.started(mode)?;
            let mismatches = self.compare(mode, &mut array, &mut first_mismatch, tick)?;
            let read_back_mismatches = self.read_back(mode, &mut array)?;
            instructions += array.instructions();
            modes.push(ModeVerification {
                mode,
                mismatches,
                read_back_mismatches,
            });
        }
        let seconds = started.elapsed().as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "a count to print")]
        let instructions_per_s = instructions as f64 / seconds;
        Ok(Verification {
            image: self.image_name.clone(),
            cells: self.cells,
            edges: self.edges,
            edge_hz: self.clock.edge_hz,
            mismatches: modes.iter().map(|m| m.mismatches + m.read_back_mismatches as u64).sum(),
            first_mismatch,
            modes,
            instructions,
            seconds,
            instructions_per_s,
        })
    }

    /// Number of codes that are not the twin's.
    fn compare(
        &self,
        mode: WeightMode,
        array: &mut Array,
        first: &mut Option<Mismatch>,
        tick: &dyn Fn(u64),
    ) -> Result<u64, CliError> {
        let weights = self.weights(mode);
        let (cells, taxels) = (self.cells, weights.taxels());
        let (mut codes, mut levels) = (Vec::new(), Vec::new());
        let (mut done, mut mismatches) = (0, 0);
        while done < self.edges {
            let edges = usize::try_from(self.edges - done).map_or(CHUNK, |left| left.min(CHUNK));
            codes.resize(edges * cells, 0);
            levels.resize(edges * taxels, 0.0);
            array.clock(self.clock, &mut codes).map_err(|e| self.unusable(&e))?;
            weights.fill_rows(done, &mut levels);
            for ((edge, codes), levels) in (done..).zip(codes.chunks_exact(cells)).zip(levels.chunks_exact(taxels)) {
                // a cell beyond the raster's hundred is never selected
                let expected = levels.iter().copied().chain(std::iter::repeat(0.0));
                for ((taxel, &code), expected) in codes.iter().enumerate().zip(expected) {
                    if mode.code_level(code).to_bits() != expected.to_bits() {
                        mismatches += 1;
                        first.get_or_insert(Mismatch {
                            mode,
                            edge,
                            taxel,
                            code,
                        });
                    }
                }
            }
            done += edges as u64;
            tick(edges as u64);
        }
        Ok(mismatches)
    }

    /// Number of cells that, asked over the bus, do not report the mode and the next level that the twin expects.
    fn read_back(&self, mode: WeightMode, array: &mut Array) -> Result<usize, CliError> {
        let weights = self.weights(mode);
        let mut wrong = 0;
        for (taxel, address) in (0..).zip(FIRST_ADDRESS..).take(self.cells) {
            let mut reply = [0; REPLY_BYTES];
            array.read(address, &mut reply).map_err(|e| self.unusable(&e))?;
            let [mode_byte, .., state_top, counter, _] = reply;
            let next_code = match mode {
                WeightMode::Raster if u64::from(counter) + 1 == u64::from(address) => u8::MAX,
                WeightMode::Raster => NEUTRAL_CODE,
                WeightMode::Analog => state_top,
                WeightMode::Binary if state_top < 128 => 0,
                WeightMode::Binary => u8::MAX,
            };
            let expected = match mode {
                WeightMode::Raster if usize::from(address - FIRST_ADDRESS) >= RASTER_PERIOD => 0.0,
                _ => weights.level(taxel, self.edges),
            };
            let next_is_right = mode.code_level(next_code).to_bits() == expected.to_bits();
            wrong += usize::from(!(next_is_right && mode_byte == cell_mode(mode).byte()));
        }
        Ok(wrong)
    }
}
