//! One cell.

/// Lowest address.
pub const FIRST_ADDRESS: u8 = 8;
/// Highest address, and the count at which the raster starts over.
pub const LAST_ADDRESS: u8 = 107;
/// DAC code at which a taxel does not drive the sum: mid-scale.
pub const NEUTRAL_CODE: u8 = 126;

/// Count from which the first edge reaches the first address.
const COUNTER_START: u8 = FIRST_ADDRESS - 1;
const MULTIPLIER: u32 = 1_664_525;
const INCREMENT: u32 = 1_013_904_223;

/// A cell or an array that cannot exist.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FirmwareError {
    /// An address outside the range that the raster counts through.
    #[error("address {address} is outside [8, 107]")]
    Address {
        /// Offending address.
        address: u8,
    },
    /// More cells than addresses, or none.
    #[error("{cells} cells do not fit on one bus; the range is [1, 100]")]
    Cells {
        /// Number asked for.
        cells: usize,
    },
}

/// What a cell puts out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellMode {
    /// Code 255 when it is this cell's turn, mid-scale otherwise. Mode byte 0.
    Raster,
    /// Top byte of the generator. Mode byte 1.
    Analog,
    /// Code 0 or 255 by the top bit of the generator. Mode byte 2.
    Binary,
}

impl CellMode {
    /// Mode that `byte` selects, if any.
    #[must_use]
    pub fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Self::Raster),
            1 => Some(Self::Analog),
            2 => Some(Self::Binary),
            _ => None,
        }
    }

    /// Byte that selects this mode.
    #[must_use]
    pub fn byte(self) -> u8 {
        match self {
            Self::Raster => 0,
            Self::Analog => 1,
            Self::Binary => 2,
        }
    }
}

/// State of one cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    address: u8,
    mode: CellMode,
    counter: u8,
    state: u32,
    code: u8,
}

impl Cell {
    /// Cell as it powers up.
    ///
    /// # Errors
    /// [`FirmwareError::Address`] outside 8…107.
    pub fn new(address: u8) -> Result<Self, FirmwareError> {
        if !(FIRST_ADDRESS..=LAST_ADDRESS).contains(&address) {
            return Err(FirmwareError::Address { address });
        }
        Ok(Self {
            address,
            mode: CellMode::Raster,
            counter: COUNTER_START,
            state: u32::from(address),
            code: NEUTRAL_CODE,
        })
    }

    /// I²C address.
    #[must_use]
    pub fn address(&self) -> u8 {
        self.address
    }

    /// Present DAC code; also what an I²C read returns.
    #[must_use]
    pub fn code(&self) -> u8 {
        self.code
    }

    /// One I²C write to this cell: pairs of mode and seed.
    pub fn receive(&mut self, bytes: &[u8]) {
        let (pairs, _) = bytes.as_chunks::<2>();
        for &[mode, seed] in pairs {
            if let Some(mode) = CellMode::from_byte(mode) {
                self.mode = mode;
                self.state = u32::from(seed);
                self.counter = COUNTER_START;
            }
        }
    }

    /// One edge of the clock. Returns the new DAC code.
    pub fn edge(&mut self) -> u8 {
        self.code = match self.mode {
            CellMode::Raster => {
                self.counter += 1;
                let mine = self.counter == self.address;
                if self.counter == LAST_ADDRESS {
                    self.counter = COUNTER_START;
                }
                if mine { u8::MAX } else { NEUTRAL_CODE }
            }
            CellMode::Analog => self.step(),
            CellMode::Binary => {
                if self.step() < 128 {
                    0
                } else {
                    u8::MAX
                }
            }
        };
        self.code
    }

    /// Steps the generator and returns its top byte.
    fn step(&mut self) -> u8 {
        self.state = MULTIPLIER.wrapping_mul(self.state).wrapping_add(INCREMENT);
        let [.., top] = self.state.to_le_bytes();
        top
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(cell: &mut Cell, edges: usize) -> Vec<u8> {
        (0..edges).map(|_| cell.edge()).collect()
    }

    #[test]
    fn the_raster_selects_each_cell_once_in_a_hundred_edges() {
        for (address, turn) in [(8, 0), (64, 56), (107, 99)] {
            let mut cell = Cell::new(address).unwrap();
            let expected: Vec<u8> = (0..300).map(|e| if e % 100 == turn { 255 } else { 126 }).collect();
            assert_eq!(codes(&mut cell, 300), expected, "address {address}");
        }
    }

    /// First state from seed 8 by hand: 8·1664525 + 1013904223 = 1027220423 = 0x3D3A_23C7.
    #[test]
    fn the_generator_starts_from_the_seed_byte() {
        let mut cell = Cell::new(20).unwrap();
        cell.receive(&[1, 8]);
        assert_eq!(cell.edge(), 0x3d);
        cell.receive(&[2, 8]);
        assert_eq!(cell.edge(), 0);
    }

    #[test]
    fn what_the_firmware_leaves_open() {
        assert_eq!(Cell::new(7), Err(FirmwareError::Address { address: 7 }));
        assert_eq!(Cell::new(108), Err(FirmwareError::Address { address: 108 }));
        let fresh = Cell::new(50).unwrap();
        assert_eq!(fresh.code(), NEUTRAL_CODE);
        for ignored in [&[][..], &[1], &[3, 9], &[255, 255, 2]] {
            let mut cell = fresh.clone();
            cell.receive(ignored);
            assert_eq!(cell, fresh, "{ignored:?}");
        }
        let mut cell = fresh.clone();
        cell.receive(&[0, 50, 2, 9]);
        let mut last_pair_only = fresh;
        last_pair_only.receive(&[2, 9]);
        assert_eq!(codes(&mut cell, 50), codes(&mut last_pair_only, 50));
    }

    #[test]
    fn a_pair_restarts_the_raster_and_leaves_the_output_alone() {
        let mut cell = Cell::new(9).unwrap();
        assert_eq!(codes(&mut cell, 2), [126, 255]);
        cell.receive(&[0, 9]);
        assert_eq!(cell.code(), 255);
        assert_eq!(codes(&mut cell, 2), [126, 255]);
    }
}
