//! Compares emulated cells with the circuit's weights, code by code.

use super::cells::EmulatedCells;
use super::error::{CellFailure, FirmwareError};
use super::task::CellTask;
use rayon::prelude::*;
use serde::Serialize;
use spts::chain::start_message;
use spts::progress::Progress;
use spts_circuit::Weights;
use spts_firmware::{Array, Cell, FIRST_ADDRESS, REPLY_BYTES};
use std::time::Instant;

/// Edges between two comparisons, a step of progress: a megabyte of codes and its levels for a hundred cells.
const CHUNK: usize = 4096;

/// The first code of an emulated cell that differs from the weight that the twin computes by formula.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mismatch {
    /// Task of the cells.
    #[serde(flatten)]
    pub task: CellTask,
    /// Edge since loading the seeds, from 0.
    pub edge: u64,
    /// Taxel, from 0.
    pub taxel: usize,
    /// DAC code of the emulated cell.
    pub code: u8,
    /// Level of that code.
    pub level: f64,
    /// The twin's weight.
    pub expected_level: f64,
}

/// How many codes and replies of emulated cells differ from the twin's in one mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeVerification {
    /// Task of the cells.
    #[serde(flatten)]
    pub task: CellTask,
    /// Number of codes, out of cells × edges, that differ from the twin's.
    pub mismatches: u64,
    /// Number of cells whose final reply (mode, state, counter, code) differs from that of the behavioural cell.
    pub read_back_mismatches: usize,
}

/// Results of `spts firmware verify`: whether emulated cells put out the weights that the twin computes by formula.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Name of the image.
    pub image: String,
    /// Number of cells on the bus.
    pub cells: usize,
    /// Number of clock edges in every mode.
    pub edges: u64,
    /// Rate of the clock, Hz.
    pub edge_hz: f64,
    /// Number of codes and replies that differ from the twin's, over all modes.
    pub mismatches: u64,
    /// The first code that differs.
    pub first_mismatch: Option<Mismatch>,
    /// Results for each mode.
    pub modes: Vec<ModeVerification>,
    /// Number of instructions that the cells executed.
    pub instructions: u64,
    /// Wall time of the emulation and the comparison, s.
    pub seconds: f64,
    /// Emulated instructions a second, summed over all threads.
    pub instructions_per_s: f64,
}

impl EmulatedCells {
    /// Runs the cells in every mode and compares.
    ///
    /// # Errors
    /// [`FirmwareError`] if the array cannot be built, or a cell does not answer.
    pub fn verify(&self, progress: &dyn Progress) -> Result<Verification, FirmwareError> {
        let blocks = usize::try_from(self.edges).unwrap_or(usize::MAX).div_ceil(CHUNK);
        progress.stage("clocking the cells", Some(blocks.saturating_mul(self.tasks.len())));
        let started = Instant::now();
        let (mut modes, mut first_mismatch, mut instructions) = (Vec::new(), None, 0);
        for &task in &self.tasks {
            let mut array = self.started(task)?;
            let mismatches = self.compare(task, &mut array, &mut first_mismatch, progress)?;
            let read_back_mismatches = self.read_back(task, &mut array)?;
            instructions += array.instructions();
            modes.push(ModeVerification {
                task,
                mismatches,
                read_back_mismatches,
            });
        }
        progress.end();
        let seconds = started.elapsed().as_secs_f64();
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
        task: CellTask,
        array: &mut Array,
        first: &mut Option<Mismatch>,
        progress: &dyn Progress,
    ) -> Result<u64, FirmwareError> {
        let (weights, mode) = (self.expected_weights(task)?, task.levels());
        let (cells, taxels) = (self.cells, weights.taxels());
        let (mut codes, mut levels) = (Vec::new(), Vec::new());
        let (mut done, mut mismatches) = (0, 0);
        while done < self.edges {
            let edges = usize::try_from(self.edges - done).map_or(CHUNK, |left| left.min(CHUNK));
            codes.resize(edges * cells, 0);
            levels.resize(edges * taxels, 0.0);
            array.clock(self.clock, &mut codes).map_err(|e| self.unusable(e))?;
            weights.fill_rows(done, &mut levels);
            for ((edge, codes), levels) in (done..).zip(codes.chunks_exact(cells)).zip(levels.chunks_exact(taxels)) {
                // a cell beyond the raster's hundred is never selected
                let expected = levels.iter().copied().chain(std::iter::repeat(0.0));
                for ((taxel, &code), expected) in codes.iter().enumerate().zip(expected) {
                    if mode.code_level(code).to_bits() != expected.to_bits() {
                        mismatches += 1;
                        first.get_or_insert(Mismatch {
                            task,
                            edge,
                            taxel,
                            code,
                            level: mode.code_level(code),
                            expected_level: expected,
                        });
                    }
                }
            }
            done += edges as u64;
            progress.step();
        }
        Ok(mismatches)
    }

    /// Number of cells that, asked over the bus, do not give the reply of the behavioural cell: mode, state, counter
    /// and code.
    fn read_back(&self, task: CellTask, array: &mut Array) -> Result<usize, FirmwareError> {
        let weights = self.expected_weights(task)?;
        let expected: Vec<_> = (0..self.cells)
            .into_par_iter()
            .map(|taxel| self.reply(&weights, taxel))
            .collect();
        let mut wrong = 0;
        for (address, expected) in (FIRST_ADDRESS..).zip(expected) {
            let mut reply = [0; REPLY_BYTES];
            array.read(address, &mut reply).map_err(|e| self.unusable(e))?;
            wrong += usize::from(expected.map_err(|e| self.unusable(e))? != reply);
        }
        Ok(wrong)
    }

    /// What the cell of `taxel` replies after all edges.
    fn reply(&self, weights: &Weights, taxel: usize) -> Result<[u8; REPLY_BYTES], CellFailure> {
        let mut cell = Cell::new(FIRST_ADDRESS.saturating_add(u8::try_from(taxel).unwrap_or(u8::MAX)))?;
        cell.receive(&start_message(weights, taxel, cell.address())?);
        for _ in 0..self.edges {
            cell.edge();
        }
        let mut reply = [0; REPLY_BYTES];
        cell.read(&mut reply);
        Ok(reply)
    }
}
