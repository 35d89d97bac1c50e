//! Voltage references.

/// First address.
pub(super) const BASE: u16 = 0x00a0;
/// Addresses from the first on.
pub(super) const LEN: u16 = 2;

/// Registers of VREF.
#[derive(Debug, Clone, Default)]
pub(super) struct Vref {
    registers: [u8; 2],
}

impl Vref {
    pub(super) fn read(&self, address: u16) -> Option<u8> {
        self.registers.get(usize::from(address - BASE)).copied()
    }

    pub(super) fn write(&mut self, address: u16, value: u8) {
        let mask = [0x77, 0x03];
        let k = usize::from(address - BASE);
        if let (Some(register), Some(mask)) = (self.registers.get_mut(k), mask.get(k)) {
            *register = value & mask;
        }
    }

    /// Reference of DAC0 (V), nominal; `None` for a reserved code.
    ///
    /// The DAC requests its reference, so DAC0REFEN need not be set.
    pub(super) fn dac0_v(&self) -> Option<f64> {
        match self.registers[0] & 0x07 {
            0 => Some(0.55),
            1 => Some(1.1),
            2 => Some(2.5),
            3 => Some(4.34),
            4 => Some(1.5),
            _ => None,
        }
    }
}
