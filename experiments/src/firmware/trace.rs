//! What one cell does, instruction by instruction.

use super::edges::Edges;
use super::plan::Plan;
use crate::cli::CliError;
use spts_circuit::WeightMode;
use spts_firmware::attiny412::TraceRecord;

impl Plan {
    /// Passes every step of the cell of `taxel`, seeded in `mode`, on to `line`, for as many edges as the plan has.
    ///
    /// # Errors
    /// [`CliError::Usage`] when there is no such taxel or a cell does not answer.
    pub fn trace(&self, mode: WeightMode, taxel: usize, line: &mut dyn FnMut(&TraceRecord)) -> Result<(), CliError> {
        let mut edges = Edges::new(self.cell(mode, taxel)?, self.clock.edge_hz);
        for _ in 0..self.edges {
            edges.traced(line);
        }
        Ok(())
    }
}
