//! Cells on a shared bus and clock.

use crate::cell::{Cell, CellMode, FIRST_ADDRESS, FirmwareError, LAST_ADDRESS};

/// A transaction that no cell answers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no cell acknowledges address {address}")]
pub struct BusError {
    /// Address on the bus.
    pub address: u8,
}

/// Cells at consecutive addresses from 8, on one I²C bus and one clock line.
#[derive(Debug, Clone)]
pub struct Array {
    cells: Vec<Cell>,
}

impl Array {
    /// Array of `cells` cells as they power up.
    ///
    /// # Errors
    /// [`FirmwareError::Cells`] for none or more than 100: the raster counts to address 107.
    pub fn new(cells: usize) -> Result<Self, FirmwareError> {
        let capacity = usize::from(LAST_ADDRESS - FIRST_ADDRESS) + 1;
        if cells == 0 || cells > capacity {
            return Err(FirmwareError::Cells { cells });
        }
        let cells = (FIRST_ADDRESS..=LAST_ADDRESS)
            .take(cells)
            .map(Cell::new)
            .collect::<Result<_, _>>()?;
        Ok(Self { cells })
    }

    /// The cells, by address.
    #[must_use]
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// One I²C write of `bytes` to `address`.
    ///
    /// # Errors
    /// [`BusError`] when no cell has that address.
    pub fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), BusError> {
        let cell = self
            .cells
            .iter_mut()
            .find(|c| c.address() == address)
            .ok_or(BusError { address })?;
        cell.receive(bytes);
        Ok(())
    }

    /// What the master does to start a session: writes `mode` and its address to every cell.
    pub fn start(&mut self, mode: CellMode) {
        for cell in &mut self.cells {
            cell.receive(&[mode.byte(), cell.address()]);
        }
    }

    /// One edge of the clock: every cell's new DAC code, as far as `codes` reaches.
    pub fn edge(&mut self, codes: &mut [u8]) {
        for (k, cell) in self.cells.iter_mut().enumerate() {
            let new = cell.edge();
            if let Some(code) = codes.get_mut(k) {
                *code = new;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cell_is_selected_at_every_edge() {
        let mut array = Array::new(100).unwrap();
        array.start(CellMode::Raster);
        let mut codes = [0; 100];
        for edge in 0..250 {
            array.edge(&mut codes);
            let selected: Vec<usize> = (0..100).filter(|k| codes[*k] == 255).collect();
            assert_eq!(selected, [edge % 100]);
        }
    }

    #[test]
    fn the_bus_reaches_only_the_addressed_cell() {
        let mut array = Array::new(3).unwrap();
        let before = array.cells().to_vec();
        assert_eq!(array.write(11, &[2, 11]), Err(BusError { address: 11 }));
        array.write(9, &[2, 77]).unwrap();
        assert_eq!((&array.cells()[0], &array.cells()[2]), (&before[0], &before[2]));
        assert_ne!(array.cells()[1], before[1]);
        assert_eq!(Array::new(101).unwrap_err(), FirmwareError::Cells { cells: 101 });
        assert_eq!(Array::new(0).unwrap_err(), FirmwareError::Cells { cells: 0 });
    }
}
