//! Clock edges that a cell misses.

use super::cells::EmulatedCells;
use super::edges::Edges;
use super::error::FirmwareError;
use super::task::CellTask;
use super::timing::{SLOW_HZ, TAXEL};
use spts_circuit::WeightMode;

/// Edges of the fast clock.
const EDGES: u32 = 5000;
/// Binary codes that tell by how many edges the cell lags: a wrong lag matches with a chance of 5000·2⁻⁶⁴.
const CODES: usize = 64;

impl EmulatedCells {
    /// Share of edges at `edge_hz` that a binary cell misses, from the final lag of its sequence. `None` if its output
    /// is not part of the sequence.
    ///
    /// # Errors
    /// [`FirmwareError`] if the cell does not answer on the bus.
    pub fn lost_share(&self, edge_hz: f64) -> Result<Option<f64>, FirmwareError> {
        let mode = WeightMode::Binary;
        let task = CellTask::Mode(mode);
        let mut edges = Edges::new(self.cell(task, TAXEL)?, edge_hz);
        edges.by_ref().take(EDGES as usize).for_each(drop);
        let slow = edges.at(SLOW_HZ).take(CODES);
        let codes: Vec<f64> = slow.map(|answer| mode.code_level(answer.code)).collect();
        let weights = self.expected_weights(task)?;
        let mut rows = vec![0.0; (EDGES as usize + CODES) * weights.taxels()];
        weights.fill_rows(0, &mut rows);
        let sequence: Vec<f64> = rows.chunks_exact(weights.taxels()).map(|row| row[TAXEL]).collect();
        let first = sequence.windows(CODES).rposition(|window| window == codes);
        Ok(first.map(|first| 1.0 - first as f64 / f64::from(EDGES)))
    }
}
