//! Array and specification side by side.

use spts_firmware::{Array, Cell, CellMode, Clock, Image, REPLY_BYTES};

pub(crate) const CLOCK: Clock = Clock {
    edge_hz: 72e3,
    sample_delay_s: 11e-6,
};

pub(crate) const MODES: [CellMode; 3] = [CellMode::Raster, CellMode::Analog, CellMode::Binary];

/// Array and specification, both seeded with their addresses.
pub(crate) fn seeded(cells: usize, mode: CellMode) -> (Array, Vec<Cell>) {
    let mut array = Array::new(cells, &Image::shipped()).unwrap();
    array.start(mode).unwrap();
    let mut spec: Vec<Cell> = (8..).take(cells).map(|address| Cell::new(address).unwrap()).collect();
    for cell in &mut spec {
        cell.receive(&mode.pair(cell.address()));
    }
    (array, spec)
}

pub(crate) fn clocked(array: &mut Array, edges: usize) -> Vec<u8> {
    let mut codes = vec![0; edges * array.cells().len()];
    array.clock(CLOCK, &mut codes).unwrap();
    codes
}

pub(crate) fn expected(cells: &mut [Cell], edges: usize) -> Vec<u8> {
    (0..edges)
        .flat_map(|_| cells.iter_mut().map(Cell::edge).collect::<Vec<_>>())
        .collect()
}

pub(crate) fn state(array: &mut Array, address: u8) -> [u8; REPLY_BYTES] {
    let mut reply = [0; REPLY_BYTES];
    array.read(address, &mut reply).unwrap();
    reply
}

pub(crate) fn spec_state(cell: &Cell) -> [u8; REPLY_BYTES] {
    let mut reply = [0; REPLY_BYTES];
    cell.read(&mut reply);
    reply
}

/// Codes and read-back of every cell, and that no program has touched what is not there.
pub(crate) fn assert_agrees(array: &mut Array, cells: &mut [Cell]) {
    assert_eq!(clocked(array, 30), expected(cells, 30));
    for cell in &*cells {
        assert_eq!(
            state(array, cell.address()),
            spec_state(cell),
            "read-back of {}",
            cell.address()
        );
    }
    for cell in array.cells() {
        assert_eq!(cell.faults().first(), None);
    }
}

/// The message of what was refused.
pub(crate) fn said<T: std::fmt::Debug>(result: Result<T, spts_input::Refusal>) -> String {
    result.unwrap_err().to_string()
}
