//! The weights that emulated cells put out, block by block.

use super::cells::EmulatedCells;
use super::error::FirmwareError;
use super::task::CellTask;
use spts_circuit::WeightMode;
use spts_firmware::{Array, ArrayError, Clock};

/// Edges of a block: a few megabytes of levels.
const BLOCK: usize = 4096;

/// Reads the weights that emulated cells put out, in blocks of up to 4096 clock edges, so that any number of edges fits
/// into memory.
#[derive(Debug)]
pub struct EmulatedWeights {
    array: Array,
    clock: Clock,
    mode: WeightMode,
    edges: usize,
    cells: usize,
    left: usize,
    codes: Vec<u8>,
    levels: Vec<f64>,
}

impl EmulatedCells {
    /// Starts the cells with `task` and returns a reader of the weights that they put out at the following
    /// [`EmulatedCells::edges`] clock edges.
    ///
    /// # Errors
    /// [`FirmwareError`] if a cell does not answer, or there are more edges than an array has rows.
    pub fn emulated_weights(&self, task: CellTask) -> Result<EmulatedWeights, FirmwareError> {
        let edges = usize::try_from(self.edges)?;
        Ok(EmulatedWeights {
            array: self.started(task)?,
            clock: self.clock,
            mode: task.levels(),
            edges,
            cells: self.cells,
            left: edges,
            codes: Vec::new(),
            levels: Vec::new(),
        })
    }
}

impl EmulatedWeights {
    /// Number of clock edges in all, and number of cells.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        [self.edges, self.cells]
    }

    /// Number of blocks that [`Self::next_block`] returns.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.edges.div_ceil(BLOCK)
    }

    /// Clocks the cells through the next block. Returns their weights in [−1, 1], edges × cells, row-major; `None`
    /// after the last edge.
    ///
    /// # Errors
    /// [`ArrayError`] if the cells cannot be clocked.
    pub fn next_block(&mut self) -> Result<Option<&[f64]>, ArrayError> {
        let rows = self.left.min(BLOCK);
        if rows == 0 {
            return Ok(None);
        }
        self.left -= rows;
        self.codes.resize(rows * self.cells, 0);
        self.array.clock(self.clock, &mut self.codes)?;
        self.levels.clear();
        self.levels
            .extend(self.codes.iter().map(|code| self.mode.code_level(*code)));
        Ok(Some(&self.levels))
    }
}
