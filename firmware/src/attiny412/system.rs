//! What controls the CPU: configuration change protection and interrupts; and the record of accesses without effect.

/// Something that a program does and that is not emulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// Read of an address from which the cell's program reads nothing. It gives 0.
    Read {
        /// Address.
        address: u16,
    },
    /// Write to an address, or of a value, that is not emulated. It has no effect.
    Write {
        /// Address.
        address: u16,
        /// Value.
        value: u8,
    },
    /// Write to a protected register without the key. It has no effect.
    Protected {
        /// Address.
        address: u16,
    },
    /// An instruction that is not executed.
    Illegal {
        /// Its address in flash, words.
        pc: u16,
    },
}

/// Record of the faults of a device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faults {
    first: Option<Fault>,
    count: u64,
}

impl Faults {
    /// The first fault; `None` if there is none.
    pub fn first(&self) -> Option<Fault> {
        self.first
    }

    /// Number of faults.
    pub fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn record(&mut self, fault: Fault) {
        self.first.get_or_insert(fault);
        self.count += 1;
    }
}

/// The key to protected I/O registers.
const KEY_IOREG: u8 = 0xd8;
/// Instructions behind the key in which a protected register can be written.
const WINDOW_INSTRUCTIONS: u64 = 4;

/// Configuration change protection: behind its key a protected register can be written. Any other store ends that.
#[derive(Debug, Clone, Default)]
pub(super) struct Ccp {
    open: bool,
    /// Number of executed instructions at which the window closes, once it is known.
    closes_at: Option<u64>,
}

impl Ccp {
    pub(super) fn write(&mut self, value: u8) {
        self.closes_at = None;
        self.open = value == KEY_IOREG;
    }

    pub(super) fn is_open(&self) -> bool {
        self.open
    }

    pub(super) fn check(&self, address: u16) -> Result<(), Fault> {
        self.open.then_some(()).ok_or(Fault::Protected { address })
    }

    /// Called behind each instruction while the window is open, with the number of instructions so far.
    pub(super) fn advance(&mut self, instructions: u64) {
        if self.open && instructions >= *self.closes_at.get_or_insert(instructions + WINDOW_INSTRUCTIONS) {
            self.close();
        }
    }

    #[inline]
    pub(super) fn close(&mut self) {
        if self.open {
            *self = Self::default();
        }
    }
}

/// An interrupt that has been accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Accepted {
    pub(super) vector: u8,
    level_one: bool,
}

/// The interrupt controller: one vector may have level 1, which interrupts the handlers of the others.
#[derive(Debug, Clone, Default)]
pub(super) struct Cpuint {
    pub(super) level1_vector: u8,
    in_level0: bool,
    in_level1: bool,
}

impl Cpuint {
    /// The interrupt that comes next. Bit k of `requests` is the request of vector k.
    pub(super) fn next(&self, requests: u32) -> Option<Accepted> {
        if requests == 0 || self.in_level1 {
            return None;
        }
        let level1 = 1_u32.checked_shl(u32::from(self.level1_vector)).unwrap_or(0) & !1;
        let level_one = requests & level1 != 0;
        if !level_one && self.in_level0 {
            return None;
        }
        let vector = match level_one {
            true => self.level1_vector,
            false => u8::try_from(requests.trailing_zeros()).ok()?,
        };
        Some(Accepted { vector, level_one })
    }

    pub(super) fn enter(&mut self, accepted: Accepted) {
        match accepted.level_one {
            true => self.in_level1 = true,
            false => self.in_level0 = true,
        }
    }

    /// RETI of the handler that runs.
    pub(super) fn leave(&mut self) {
        match self.in_level1 {
            true => self.in_level1 = false,
            false => self.in_level0 = false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_one_preempts_level_zero_and_nothing_preempts_level_one() {
        let [port, timer, twi] = [3, 8, 19].map(|vector| 1_u32 << vector);
        let mut cpuint = Cpuint { level1_vector: 3, ..Cpuint::default() };
        let source = |cpuint: &Cpuint, requests| cpuint.next(requests).map(|accepted| accepted.vector);
        cpuint.enter(cpuint.next(twi).unwrap());
        assert_eq!(source(&cpuint, timer | twi), None);
        assert_eq!(source(&cpuint, port | twi), Some(3));
        cpuint.enter(cpuint.next(port | twi).unwrap());
        assert_eq!(source(&cpuint, port | twi | timer), None);
        cpuint.leave();
        assert_eq!(source(&cpuint, timer), None);
        cpuint.leave();
        assert_eq!(source(&cpuint, twi | timer), Some(8));
    }
}
