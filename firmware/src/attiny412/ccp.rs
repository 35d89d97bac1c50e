//! Configuration change protection.

use super::fault::Fault;

/// Key that opens protected I/O registers.
const KEY_IOREG: u8 = 0xd8;
/// Key that opens self-programming commands.
const KEY_SPM: u8 = 0x9d;
/// Instructions after the key within which the protected write has to come.
const WINDOW_INSTRUCTIONS: u64 = 4;

/// What a key has opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    /// Protected I/O registers.
    Ioreg,
    /// Commands of the memory controller.
    Spm,
}

/// An access that ends a window before its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    /// Store to an I/O register or SRAM: closes the window of protected I/O registers.
    Store,
    /// Load or store of flash, EEPROM or memory controller: closes any window.
    Memory,
}

/// Register CPU.CCP: a key opens protected registers for four instructions, in which no interrupt is taken. The window
/// ends behind the first [`Access`] that ends it, the protected write among them, and at SLEEP.
///
/// Source: tinyAVR 1-series data sheet (DS40002287), section "Configuration Change Protection (CCP)".
#[derive(Debug, Clone, Default)]
pub(super) struct Ccp {
    open: Option<Key>,
    /// Instruction count at which the window closes, once it is known.
    closes_at: Option<u64>,
}

impl Ccp {
    /// Writes the key register; a value that is no key closes the window.
    pub(super) fn write(&mut self, value: u8) {
        self.closes_at = None;
        self.open = match value {
            KEY_IOREG => Some(Key::Ioreg),
            KEY_SPM => Some(Key::Spm),
            _ => None,
        };
    }

    /// Register as read: bit 0 while I/O registers are open, bit 1 as well while commands are.
    pub(super) fn read(&self) -> u8 {
        match self.open {
            None => 0,
            Some(Key::Ioreg) => 1,
            Some(Key::Spm) => 2,
        }
    }

    /// Whether any window is open.
    pub(super) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Whether `key` has opened what `address` protects; the fault to record if not.
    pub(super) fn check(&self, key: Key, address: u16) -> Result<(), Fault> {
        if self.open == Some(key) {
            Ok(())
        } else {
            Err(Fault::Protected { address })
        }
    }

    /// Takes note of the instructions executed so far, between two instructions.
    pub(super) fn advance(&mut self, instructions: u64) {
        if self.open.is_some() {
            let closes_at = *self.closes_at.get_or_insert(instructions + WINDOW_INSTRUCTIONS);
            if instructions >= closes_at {
                self.close();
            }
        }
    }

    /// Takes note of an access that is being made.
    #[inline]
    pub(super) fn end_by(&mut self, access: Access) {
        if self.is_open() && self.is_ended_by(access) {
            self.close();
        }
    }

    /// Takes note of an access that the next instruction makes, `instructions` having been executed.
    pub(super) fn end_behind_next(&mut self, access: Access, instructions: u64) {
        if self.is_ended_by(access) {
            self.closes_at = Some(instructions + 1);
        }
    }

    fn is_ended_by(&self, access: Access) -> bool {
        self.open == Some(Key::Ioreg) || access == Access::Memory
    }

    /// Ends the window.
    pub(super) fn close(&mut self) {
        self.open = None;
        self.closes_at = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_is_four_instructions() {
        let mut ccp = Ccp::default();
        assert!(ccp.check(Key::Ioreg, 0x61).is_err());
        ccp.write(KEY_IOREG);
        for executed in 100..104 {
            ccp.advance(executed);
            assert!(ccp.check(Key::Ioreg, 0x61).is_ok(), "after {executed}");
            assert!(ccp.check(Key::Spm, 0x1000).is_err());
        }
        ccp.advance(104);
        assert!(!ccp.is_open());
        ccp.write(0x55);
        assert!(!ccp.is_open());
    }

    #[test]
    fn a_store_ends_the_window_of_registers_and_a_memory_access_both() {
        for (key, access, open) in [
            (KEY_IOREG, Access::Store, false),
            (KEY_IOREG, Access::Memory, false),
            (KEY_SPM, Access::Store, true),
            (KEY_SPM, Access::Memory, false),
        ] {
            let mut now = Ccp::default();
            now.write(key);
            let mut next = now.clone();
            now.end_by(access);
            assert_eq!(now.is_open(), open, "{key:#x}, {access:?}");
            next.advance(100);
            next.end_behind_next(access, 100);
            assert!(next.is_open());
            next.advance(101);
            assert_eq!(next.is_open(), open, "{key:#x}, {access:?}, next");
        }
    }
}
