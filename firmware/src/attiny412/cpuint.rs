//! Interrupt controller.

use super::ccp::{Ccp, Key};
use super::fault::Fault;

/// First address.
pub(super) const BASE: u16 = 0x0110;
/// Addresses from the first on.
pub(super) const LEN: u16 = 4;

const CTRLA: u16 = BASE;
const STATUS: u16 = BASE + 1;
const LVL0PRI: u16 = BASE + 2;
const LVL1VEC: u16 = BASE + 3;
/// CTRLA: round robin among level 0.
const LVL0RR: u8 = 0x01;
/// CTRLA: compact vector table.
const CVT: u8 = 0x20;
/// CTRLA: vectors in the boot section. The whole flash is boot section here, so the bit changes nothing.
const IVSEL: u8 = 0x40;
/// STATUS: a level 0 handler runs.
const LVL0EX: u8 = 0x01;
/// STATUS: a level 1 handler runs.
const LVL1EX: u8 = 0x02;

/// An interrupt that is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Accepted {
    /// Vector number of its source.
    pub(super) source: u8,
    /// Entry of the vector table to which it jumps.
    pub(super) entry: u8,
    level_one: bool,
}

/// Registers of CPUINT: two levels, one vector on level 1, order within level 0 by vector number.
///
/// Source: tinyAVR 1-series data sheet (DS40002287), chapter CPUINT.
#[derive(Debug, Clone, Default)]
pub(super) struct Cpuint {
    ctrla: u8,
    status: u8,
    level0_priority: u8,
    level1_vector: u8,
}

impl Cpuint {
    pub(super) fn read(&self, address: u16) -> Option<u8> {
        match address {
            CTRLA => Some(self.ctrla),
            STATUS => Some(self.status),
            LVL0PRI => Some(self.level0_priority),
            LVL1VEC => Some(self.level1_vector),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8, ccp: &Ccp) -> Result<(), Fault> {
        match address {
            CTRLA => {
                if (value ^ self.ctrla) & (CVT | IVSEL) != 0 {
                    ccp.check(Key::Ioreg, address)?;
                }
                self.ctrla = value & (LVL0RR | CVT | IVSEL);
            }
            LVL0PRI => self.level0_priority = value,
            LVL1VEC => self.level1_vector = value,
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    /// The interrupt to take next of `requests` (bit = vector number), as far as running handlers let it.
    pub(super) fn next(&self, requests: u32) -> Option<Accepted> {
        if requests == 0 || self.status & LVL1EX != 0 {
            return None;
        }
        let level1 = 1_u32.checked_shl(u32::from(self.level1_vector)).unwrap_or(0) & !1;
        if requests & level1 != 0 {
            return Some(self.accepted(self.level1_vector, true));
        }
        let level0 = requests & !level1;
        if level0 == 0 || self.status & LVL0EX != 0 {
            return None;
        }
        // LVL0PRI names the vector of least priority; the numbers behind it come first
        let behind = level0 & u32::MAX.checked_shl(u32::from(self.level0_priority) + 1).unwrap_or(0);
        let from = if behind == 0 { level0 } else { behind };
        let vector = u8::try_from(from.trailing_zeros()).ok()?;
        Some(self.accepted(vector, false))
    }

    fn accepted(&self, source: u8, level_one: bool) -> Accepted {
        let entry = match (self.ctrla & CVT != 0, level_one) {
            (false, _) => source,
            (true, true) => 2,
            (true, false) => 3,
        };
        Accepted {
            source,
            entry,
            level_one,
        }
    }

    /// A handler starts.
    pub(super) fn enter(&mut self, accepted: Accepted) {
        if accepted.level_one {
            self.status |= LVL1EX;
        } else {
            self.status |= LVL0EX;
            if self.ctrla & LVL0RR != 0 {
                self.level0_priority = accepted.source;
            }
        }
    }

    /// RETI: the handler of the highest running level ends.
    pub(super) fn leave(&mut self) {
        if self.status & LVL1EX != 0 {
            self.status &= !LVL1EX;
        } else {
            self.status &= !LVL0EX;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PORT: u32 = 1 << 3;
    const TIMER: u32 = 1 << 8;
    const TWI: u32 = 1 << 19;

    fn source(cpuint: &Cpuint, requests: u32) -> Option<u8> {
        cpuint.next(requests).map(|a| a.source)
    }

    #[test]
    fn level_one_preempts_level_zero_and_nothing_preempts_level_one() {
        let mut cpuint = Cpuint::default();
        cpuint.write(LVL1VEC, 3, &Ccp::default()).unwrap();
        let twi = cpuint.next(TWI).unwrap();
        cpuint.enter(twi);
        assert_eq!(source(&cpuint, TIMER | TWI), None);
        assert_eq!(source(&cpuint, PORT | TWI), Some(3));
        let port = cpuint.next(PORT | TWI).unwrap();
        cpuint.enter(port);
        assert_eq!(cpuint.read(STATUS), Some(3));
        assert_eq!(source(&cpuint, PORT | TWI | TIMER), None);
        cpuint.leave();
        assert_eq!(cpuint.read(STATUS), Some(1));
        cpuint.leave();
        assert_eq!(source(&cpuint, TWI | TIMER), Some(8));
    }

    #[test]
    fn least_priority_can_be_moved_and_goes_round() {
        let mut cpuint = Cpuint::default();
        assert_eq!(source(&cpuint, PORT | TIMER | TWI), Some(3));
        cpuint.write(LVL0PRI, 3, &Ccp::default()).unwrap();
        assert_eq!(source(&cpuint, PORT | TIMER | TWI), Some(8));
        cpuint.write(CTRLA, LVL0RR, &Ccp::default()).unwrap();
        let mut taken = vec![];
        for _ in 0..4 {
            let next = cpuint.next(PORT | TIMER | TWI).unwrap();
            taken.push(next.source);
            cpuint.enter(next);
            cpuint.leave();
        }
        assert_eq!(taken, [8, 19, 3, 8]);
    }

    #[test]
    fn the_compact_table_has_one_entry_a_level() {
        let mut ccp = Ccp::default();
        let mut cpuint = Cpuint::default();
        assert!(cpuint.write(CTRLA, CVT, &ccp).is_err());
        ccp.write(0xd8);
        cpuint.write(CTRLA, CVT, &ccp).unwrap();
        cpuint.write(LVL1VEC, 3, &ccp).unwrap();
        assert_eq!(cpuint.next(PORT).unwrap().entry, 2);
        assert_eq!(cpuint.next(TWI).unwrap().entry, 3);
    }
}
