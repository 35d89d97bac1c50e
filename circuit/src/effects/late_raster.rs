//! Late updates in a raster scan, where two cells change at each row: one switches on and one off.

use super::late_updates::Cell;
use crate::batch::Batch;
use crate::effect::{BlockStart, Effect};
use rand::RngExt as _;
use spts_models::Streams;

/// The same process as that of any weights. A cell that puts out again what it held cannot be late, so that only those
/// that change are looked at: whether their timer collides with this edge, and whether that makes them late.
pub(super) struct LateRaster {
    session: Streams,
    /// Streams of the block.
    block: Streams,
    cells: Vec<Cell>,
    /// Scratch: the cells that may change in a row.
    changing: Vec<usize>,
}

impl LateRaster {
    pub(super) fn new(session: Streams, cells: Vec<Cell>) -> Self {
        Self {
            session,
            block: session,
            cells,
            changing: Vec::new(),
        }
    }
}

impl Effect for LateRaster {
    fn begin_block(&mut self, start: &BlockStart) {
        self.block = self.session.child("late-updates", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        let count = self.cells.len() as u64;
        for (i, row) in (batch.row(0)..batch.row(batch.len())).enumerate() {
            let scanned = [row % count, (row + count - 1) % count];
            self.changing.clear();
            if batch.rows.are_given() {
                // whatever put them out, any cell may change
                self.changing.extend(0..self.cells.len());
            } else {
                let scanned = scanned.iter().filter_map(|k| usize::try_from(*k).ok());
                self.changing.extend(scanned);
                // cells that missed clocks or have faults change at other times
                self.changing.extend(batch.cells.iter().map(|cell| cell.taxel));
                self.changing.sort_unstable();
                self.changing.dedup();
            }
            for &k in &self.changing {
                let held = batch.previous_level(k, i) - batch.level(k, i);
                let cell = &self.cells[k];
                if held.abs() > 0.0 && cell.late > 0.0 && cell.collides(row) {
                    let draw: f64 = self.block.child("row", row).rng("cell", k as u64).random();
                    if draw < cell.late {
                        batch.output_v[i] += held * batch.taxel_v(k, i);
                    }
                }
            }
        }
    }
}
