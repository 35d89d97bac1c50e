//! Traces one cell, instruction by instruction.

use super::cells::EmulatedCells;
use super::edges::Edges;
use super::error::FirmwareError;
use super::task::CellTask;
use spts_firmware::FIRST_ADDRESS;
use spts_firmware::attiny412::{Device, TraceRecord};

impl EmulatedCells {
    /// Calls `line` for every step of the cell of `taxel`, started with `task`, during [`EmulatedCells::edges`] edges.
    ///
    /// # Errors
    /// [`FirmwareError`] if there is no such taxel, or a cell does not answer.
    pub fn trace(&self, task: CellTask, taxel: usize, line: &mut dyn FnMut(&TraceRecord)) -> Result<(), FirmwareError> {
        let mut edges = Edges::new(self.cell(task, taxel)?, self.clock.edge_hz);
        for _ in 0..self.edges {
            edges.traced(line);
        }
        Ok(())
    }

    /// Calls `line` for the first `ticks` ticks of the cell of `taxel` after power-on.
    ///
    /// # Errors
    /// [`FirmwareError`] if there is no such taxel.
    pub fn trace_from_reset(
        &self,
        taxel: usize,
        ticks: u64,
        line: &mut dyn FnMut(&TraceRecord),
    ) -> Result<(), FirmwareError> {
        let address = u8::try_from(taxel)
            .ok()
            .and_then(|taxel| FIRST_ADDRESS.checked_add(taxel));
        let address = address
            .filter(|_| taxel < self.cells)
            .ok_or_else(|| self.no_such(taxel))?;
        let program = Device::program(self.image.flash()).map_err(|e| self.unusable(e))?;
        Device::new(program, &[address]).trace_until(ticks, line);
        Ok(())
    }
}
