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
}
