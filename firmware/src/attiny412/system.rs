//! What controls the CPU: configuration change protection, main clock, reset, sleep and interrupts; and the record of
//! accesses without effect.

/// Something that the firmware does and the emulation does not support; it has no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// Read of an address that does not exist or whose peripheral is not emulated. Returns 0.
    Read {
        /// Data address.
        address: u16,
    },
    /// Write to such an address. Ignored.
    Write {
        /// Data address.
        address: u16,
        /// Byte written.
        value: u8,
    },
    /// Write to a protected register outside its time window. Ignored.
    Protected {
        /// Data address.
        address: u16,
    },
    /// An unsupported setting of an emulated register. Ignored.
    Unsupported {
        /// Data address.
        address: u16,
        /// Byte written.
        value: u8,
    },
    /// An opcode that the core does not have. Executed as no operation.
    Illegal {
        /// Word address.
        pc: u16,
    },
}

/// First fault, and the number of faults since power-on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faults {
    first: Option<Fault>,
    count: u64,
}

impl Faults {
    /// First fault.
    #[must_use]
    pub fn first(&self) -> Option<Fault> {
        self.first
    }

    /// Number of faults.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn record(&mut self, fault: Fault) {
        self.first.get_or_insert(fault);
        self.count += 1;
    }
}

/// Key that opens protected I/O registers.
const KEY_IOREG: u8 = 0xd8;
/// Instructions after the key within which the protected write has to come.
const WINDOW_INSTRUCTIONS: u64 = 4;

/// Register CPU.CCP: a key opens protected I/O registers for four instructions, in which no interrupt is taken. The
/// window ends behind the first store to an I/O register or SRAM, the protected write among them, the first access to
/// flash or EEPROM, and at SLEEP. The key of self-programming opens nothing: the flash cannot be written.
///
/// Source: tinyAVR 1-series data sheet (DS40002287), section "Configuration Change Protection (CCP)".
#[derive(Debug, Clone, Default)]
pub(super) struct Ccp {
    open: bool,
    /// Instruction count at which the window closes, once it is known.
    closes_at: Option<u64>,
}

impl Ccp {
    /// Writes the key register; a value that is no key closes the window.
    pub(super) fn write(&mut self, value: u8) {
        self.closes_at = None;
        self.open = value == KEY_IOREG;
    }

    /// Register as read: bit 0 while I/O registers are open.
    pub(super) fn read(&self) -> u8 {
        self.open.into()
    }

    /// Whether the window is open.
    pub(super) fn is_open(&self) -> bool {
        self.open
    }

    /// Whether the register at `address` is open; the fault to record if not.
    pub(super) fn check(&self, address: u16) -> Result<(), Fault> {
        self.open.then_some(()).ok_or(Fault::Protected { address })
    }

    /// Takes note of the instructions executed so far, between two instructions.
    pub(super) fn advance(&mut self, instructions: u64) {
        if self.open && instructions >= *self.closes_at.get_or_insert(instructions + WINDOW_INSTRUCTIONS) {
            self.close();
        }
    }

    /// Ends the window after the next instruction, `instructions` having been executed.
    pub(super) fn close_behind_next(&mut self, instructions: u64) {
        self.closes_at = Some(instructions + 1);
    }

    /// Ends the window.
    #[inline]
    pub(super) fn close(&mut self) {
        if self.open {
            *self = Self::default();
        }
    }
}

/// First and last address of CLKCTRL.
pub(super) const CLKCTRL: u16 = 0x0060;
pub(super) const CLKCTRL_END: u16 = 0x007f;

const MCLKCTRLA: u16 = CLKCTRL;
const MCLKCTRLB: u16 = CLKCTRL + 1;
const MCLKSTATUS: u16 = CLKCTRL + 3;
/// MCLKCTRLB: prescaler on.
const PEN: u8 = 0x01;
/// MCLKSTATUS: the 20 MHz oscillator is stable.
const OSC20MS: u8 = 0x10;
/// MCLKCTRLB out of reset: prescaler on, division by 6.
const MCLKCTRLB_RESET: u8 = 0x11;

/// Registers of CLKCTRL. The main clock is the internal 20 MHz oscillator; other sources are not emulated.
#[derive(Debug, Clone)]
pub(super) struct Clkctrl {
    mclkctrlb: u8,
    ticks_per_cycle: u64,
}

impl Default for Clkctrl {
    fn default() -> Self {
        Self {
            mclkctrlb: MCLKCTRLB_RESET,
            ticks_per_cycle: 6,
        }
    }
}

impl Clkctrl {
    /// Oscillator ticks in a CPU cycle.
    pub(super) fn ticks_per_cycle(&self) -> u64 {
        self.ticks_per_cycle
    }

    pub(super) fn read(&self, address: u16) -> Option<u8> {
        match address {
            MCLKCTRLA => Some(0),
            MCLKCTRLB => Some(self.mclkctrlb),
            MCLKSTATUS => Some(OSC20MS),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8, ccp: &Ccp) -> Result<(), Fault> {
        if !matches!(address, MCLKCTRLA | MCLKCTRLB) {
            return Err(Fault::Write { address, value });
        }
        ccp.check(address)?;
        match address {
            MCLKCTRLA if value != 0 => return Err(Fault::Unsupported { address, value }),
            MCLKCTRLB => {
                self.ticks_per_cycle = division(value).ok_or(Fault::Unsupported { address, value })?;
                self.mclkctrlb = value & 0x1f;
            }
            _ => {}
        }
        Ok(())
    }
}

/// Division of MCLKCTRLB. `None` for reserved codes.
fn division(mclkctrlb: u8) -> Option<u64> {
    if mclkctrlb & PEN == 0 {
        return Some(1);
    }
    match mclkctrlb >> 1 & 0x0f {
        code @ 0..=5 => Some(2 << code),
        8 => Some(6),
        9 => Some(10),
        10 => Some(12),
        11 => Some(24),
        12 => Some(48),
        _ => None,
    }
}

/// First and last address of RSTCTRL.
pub(super) const RSTCTRL: u16 = 0x0040;
pub(super) const RSTCTRL_END: u16 = 0x0041;

const RSTFR: u16 = RSTCTRL;
const SWRR: u16 = RSTCTRL + 1;

/// Cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResetCause {
    /// Supply switched on. The content of SRAM is undefined.
    PowerOn,
    /// Supply fell below the brown-out level. SRAM is kept.
    BrownOut,
    /// Reset pin.
    External,
    /// Requested by the program.
    Software,
}

impl ResetCause {
    /// Its bit in RSTFR.
    fn flag(self) -> u8 {
        match self {
            Self::PowerOn => 0x01,
            Self::BrownOut => 0x02,
            Self::External => 0x04,
            Self::Software => 0x10,
        }
    }
}

/// Registers of RSTCTRL.
#[derive(Debug, Clone, Default)]
pub(super) struct Rstctrl {
    flags: u8,
    requested: bool,
}

impl Rstctrl {
    pub(super) fn read(&self, address: u16) -> u8 {
        if address == RSTFR { self.flags } else { 0 }
    }

    pub(super) fn write(&mut self, address: u16, value: u8, ccp: &Ccp) -> Result<(), Fault> {
        match address {
            RSTFR => self.flags &= !value,
            SWRR => {
                ccp.check(address)?;
                self.requested = value & 1 != 0;
            }
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    /// Whether the program has asked for a reset.
    pub(super) fn requested(&self) -> bool {
        self.requested
    }

    /// Registers after a reset by `cause`: flags gather until the program clears them; power-on clears the others.
    pub(super) fn after(&self, cause: ResetCause) -> Self {
        let kept = if cause == ResetCause::PowerOn { 0 } else { self.flags };
        Self {
            flags: kept | cause.flag(),
            requested: false,
        }
    }
}

/// Address of SLPCTRL_CTRLA, the only register.
pub(super) const SLPCTRL_CTRLA: u16 = 0x0050;
const SEN: u8 = 0x01;

/// Register of SLPCTRL. Idle is emulated; standby and power-down are not.
#[derive(Debug, Clone, Default)]
pub(super) struct Slpctrl {
    ctrla: u8,
}

impl Slpctrl {
    pub(super) fn read(&self) -> u8 {
        self.ctrla
    }

    pub(super) fn write(&mut self, value: u8) -> Result<(), Fault> {
        if value & !SEN != 0 {
            return Err(Fault::Unsupported {
                address: SLPCTRL_CTRLA,
                value,
            });
        }
        self.ctrla = value;
        Ok(())
    }

    /// Whether SLEEP stops the CPU.
    pub(super) fn enabled(&self) -> bool {
        self.ctrla & SEN != 0
    }
}

/// First and last address of CPUINT.
pub(super) const CPUINT: u16 = 0x0110;
pub(super) const CPUINT_END: u16 = 0x0113;

const CPUINT_CTRLA: u16 = CPUINT;
const CPUINT_STATUS: u16 = CPUINT + 1;
const LVL1VEC: u16 = CPUINT + 3;
/// CPUINT_STATUS: a level 0 handler runs.
const LVL0EX: u8 = 0x01;
/// CPUINT_STATUS: a level 1 handler runs.
const LVL1EX: u8 = 0x02;

/// An interrupt that is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Accepted {
    /// Vector number.
    pub(super) vector: u8,
    level_one: bool,
}

/// Registers of CPUINT: two levels, one vector on level 1, order within level 0 by vector number. Neither its round
/// robin nor its compact vector table is emulated.
///
/// Source: tinyAVR 1-series data sheet (DS40002287), chapter CPUINT.
#[derive(Debug, Clone, Default)]
pub(super) struct Cpuint {
    status: u8,
    level1_vector: u8,
}

impl Cpuint {
    pub(super) fn read(&self, address: u16) -> Option<u8> {
        match address {
            CPUINT_CTRLA => Some(0),
            CPUINT_STATUS => Some(self.status),
            LVL1VEC => Some(self.level1_vector),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8) -> Result<(), Fault> {
        match address {
            CPUINT_CTRLA if value == 0 => {}
            CPUINT_CTRLA => return Err(Fault::Unsupported { address, value }),
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
            let vector = self.level1_vector;
            return Some(Accepted {
                vector,
                level_one: true,
            });
        }
        let level0 = requests & !level1;
        if level0 == 0 || self.status & LVL0EX != 0 {
            return None;
        }
        let vector = u8::try_from(level0.trailing_zeros()).ok()?;
        Some(Accepted {
            vector,
            level_one: false,
        })
    }

    /// A handler starts.
    pub(super) fn enter(&mut self, accepted: Accepted) {
        self.status |= if accepted.level_one { LVL1EX } else { LVL0EX };
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

    #[test]
    fn the_window_is_four_instructions() {
        let mut ccp = Ccp::default();
        assert!(ccp.check(0x61).is_err());
        ccp.write(KEY_IOREG);
        for executed in 100..104 {
            ccp.advance(executed);
            assert!(ccp.check(0x61).is_ok(), "after {executed}");
        }
        ccp.advance(104);
        assert!(!ccp.is_open());
        ccp.write(0x55);
        assert!(!ccp.is_open());
    }

    #[test]
    fn the_prescaler_follows_the_device_description() {
        let mut ccp = Ccp::default();
        ccp.write(0xd8);
        let mut clock = Clkctrl::default();
        assert_eq!(clock.ticks_per_cycle(), 6);
        for (pdiv, expected) in [
            (0, 2),
            (1, 4),
            (2, 8),
            (3, 16),
            (4, 32),
            (5, 64),
            (8, 6),
            (9, 10),
            (10, 12),
            (11, 24),
            (12, 48),
        ] {
            clock.write(MCLKCTRLB, pdiv << 1 | PEN, &ccp).unwrap();
            assert_eq!(clock.ticks_per_cycle(), expected, "PDIV {pdiv}");
        }
        clock.write(MCLKCTRLB, 0, &ccp).unwrap();
        assert_eq!(clock.ticks_per_cycle(), 1);
        assert!(Clkctrl::default().write(MCLKCTRLB, 0, &Ccp::default()).is_err());
    }

    const PORT: u32 = 1 << 3;
    const TIMER: u32 = 1 << 8;
    const TWI: u32 = 1 << 19;

    fn source(cpuint: &Cpuint, requests: u32) -> Option<u8> {
        cpuint.next(requests).map(|a| a.vector)
    }

    #[test]
    fn level_one_preempts_level_zero_and_nothing_preempts_level_one() {
        let mut cpuint = Cpuint::default();
        cpuint.write(LVL1VEC, 3).unwrap();
        let twi = cpuint.next(TWI).unwrap();
        cpuint.enter(twi);
        assert_eq!(source(&cpuint, TIMER | TWI), None);
        assert_eq!(source(&cpuint, PORT | TWI), Some(3));
        let port = cpuint.next(PORT | TWI).unwrap();
        cpuint.enter(port);
        assert_eq!(cpuint.read(CPUINT_STATUS), Some(3));
        assert_eq!(source(&cpuint, PORT | TWI | TIMER), None);
        cpuint.leave();
        assert_eq!(cpuint.read(CPUINT_STATUS), Some(1));
        cpuint.leave();
        assert_eq!(source(&cpuint, TWI | TIMER), Some(8));
    }
}
