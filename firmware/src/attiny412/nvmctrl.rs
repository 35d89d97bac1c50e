//! Memory controller and EEPROM.

use super::ccp::{Ccp, Key};
use super::fault::Fault;

/// First address of the registers.
pub(super) const BASE: u16 = 0x1000;
/// Addresses from the first on.
pub(super) const LEN: u16 = 0x0a;
/// First address of the EEPROM.
pub(super) const EEPROM_BASE: u16 = 0x1400;
/// Size of the EEPROM (bytes).
pub(super) const EEPROM_LEN: usize = 128;

const CTRLA: u16 = BASE;
const CTRLB: u16 = BASE + 1;
const STATUS: u16 = BASE + 2;
const EEBUSY: u8 = 0x02;
const PAGE: usize = 32;
/// Ticks of an erase or a write, and of both: 2 ms and 4 ms at 20 MHz. Source: DS40002287, electrical characteristics.
const ERASE_OR_WRITE_TICKS: u64 = 40_000;

mod command {
    pub(super) const NONE: u8 = 0;
    pub(super) const WRITE: u8 = 1;
    pub(super) const ERASE: u8 = 2;
    pub(super) const ERASE_WRITE: u8 = 3;
    pub(super) const CLEAR_BUFFER: u8 = 4;
    pub(super) const ERASE_EEPROM: u8 = 6;
}

/// EEPROM with its page buffer. The flash cannot be written.
#[derive(Debug, Clone)]
pub(super) struct Nvmctrl {
    eeprom: [u8; EEPROM_LEN],
    /// Bytes waiting in the page buffer, by position in the page.
    buffer: [Option<u8>; PAGE],
    page: usize,
    busy_until: u64,
}

impl Nvmctrl {
    /// EEPROM that starts with `bytes`; the rest is erased.
    pub(super) fn new(bytes: &[u8]) -> Self {
        let mut eeprom = [0xff; EEPROM_LEN];
        for (cell, byte) in eeprom.iter_mut().zip(bytes) {
            *cell = *byte;
        }
        Self {
            eeprom,
            buffer: [None; PAGE],
            page: 0,
            busy_until: 0,
        }
    }

    /// After a reset the buffer is empty; the EEPROM stays.
    pub(super) fn after_reset(&self) -> Self {
        Self::new(&self.eeprom)
    }

    /// Content of the EEPROM.
    pub(super) fn eeprom(&self) -> &[u8] {
        &self.eeprom
    }

    pub(super) fn read(&self, address: u16, now: u64) -> Option<u8> {
        match address {
            CTRLA | CTRLB => Some(0),
            STATUS => Some(if now < self.busy_until { EEBUSY } else { 0 }),
            _ => self.eeprom.get(usize::from(address.checked_sub(EEPROM_BASE)?)).copied(),
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8, now: u64, ccp: &Ccp) -> Result<(), Fault> {
        match address {
            CTRLA => {
                ccp.check(Key::Spm, address)?;
                self.run(value, now)
            }
            EEPROM_BASE.. => {
                let place = usize::from(address - EEPROM_BASE);
                self.page = place / PAGE;
                self.buffer[place % PAGE] = Some(value);
                Ok(())
            }
            _ => Err(Fault::Write { address, value }),
        }
    }

    fn run(&mut self, value: u8, now: u64) -> Result<(), Fault> {
        let address = CTRLA;
        if now < self.busy_until {
            return Err(Fault::Unsupported { address, value });
        }
        match value {
            command::NONE | command::CLEAR_BUFFER => {}
            command::WRITE => self.apply(|old, new| old & new),
            command::ERASE => self.apply(|_, _| 0xff),
            command::ERASE_WRITE => self.apply(|_, new| new),
            command::ERASE_EEPROM => self.eeprom.fill(0xff),
            _ => return Err(Fault::Unsupported { address, value }),
        }
        self.busy_until = now
            + match value {
                command::NONE | command::CLEAR_BUFFER => 0,
                command::ERASE_WRITE => 2 * ERASE_OR_WRITE_TICKS,
                _ => ERASE_OR_WRITE_TICKS,
            };
        if value != command::NONE {
            self.buffer = [None; PAGE];
        }
        Ok(())
    }

    /// Only bytes that are in the buffer change.
    fn apply(&mut self, byte: impl Fn(u8, u8) -> u8) {
        let cells = self.eeprom.iter_mut().skip(self.page * PAGE);
        for (cell, waiting) in cells.zip(&self.buffer) {
            if let Some(new) = waiting {
                *cell = byte(*cell, *new);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_buffered_bytes_are_written_and_only_by_command() {
        let mut ccp = Ccp::default();
        let mut memory = Nvmctrl::new(&[8, 1]);
        memory.write(EEPROM_BASE, 0x0f, 0, &ccp).unwrap();
        memory.write(EEPROM_BASE + 33, 0x33, 0, &ccp).unwrap();
        assert!(memory.write(CTRLA, command::ERASE_WRITE, 0, &ccp).is_err());
        ccp.write(0x9d);
        memory.write(CTRLA, command::CLEAR_BUFFER, 0, &ccp).unwrap();
        memory.write(EEPROM_BASE, 0x3c, 0, &ccp).unwrap();
        memory.write(CTRLA, command::ERASE_WRITE, 10, &ccp).unwrap();
        assert_eq!(memory.read(EEPROM_BASE, 10), Some(0x3c));
        assert_eq!(memory.read(EEPROM_BASE + 1, 10), Some(1));
        assert_eq!(memory.read(EEPROM_BASE + 33, 10), Some(0xff));
        assert_eq!(memory.read(STATUS, 80_009), Some(EEBUSY));
        assert_eq!(memory.read(STATUS, 80_010), Some(0));
        memory.write(EEPROM_BASE, 0x0f, 80_010, &ccp).unwrap();
        memory.write(CTRLA, command::WRITE, 80_010, &ccp).unwrap();
        assert_eq!(memory.after_reset().eeprom()[0], 0x0c);
    }
}
