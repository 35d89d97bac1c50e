//! Memory map: SRAM, and the registers and EEPROM that a cell's program uses.

use super::pins::{CLOCK_BIT, ClockPin, Dac, PORT_VECTOR};
use super::system::{Ccp, Cpuint, Fault, Faults};
use super::tca::{self, Tca};
use super::twi::{self, Twi};
use crate::avr::DataSpace;

/// 256 bytes of SRAM at 0x3F00.
const SRAM_LEN: usize = 256;
const SRAM_PAGE: u16 = 0x3f;
/// Last address of SRAM.
pub(super) const RAM_END: u16 = 0x3fff;
/// Size of the flash, bytes.
pub(super) const FLASH_LEN: u16 = 0x1000;
const EEPROM: u16 = 0x1400;
const EEPROM_LEN: usize = 128;
const EEPROM_END: u16 = EEPROM + 0x7f;

const VPORT_INTFLAGS: u16 = 0x0003;
const CCP: u16 = 0x0034;
const RSTCTRL_SWRR: u16 = 0x0041;
const SLPCTRL_CTRLA: u16 = 0x0050;
const CLKCTRL_MCLKCTRLB: u16 = 0x0061;
const VREF_CTRLA: u16 = 0x00a0;
const CPUINT_LVL1VEC: u16 = 0x0113;
const PORT_PIN3CTRL: u16 = 0x0413;
const PORT_PIN6CTRL: u16 = 0x0416;
const DAC_CTRLA: u16 = 0x0680;
const DAC_DATA: u16 = 0x0681;

/// Ticks of the oscillator a cycle after reset: the prescaler divides by 6.
const RESET_DIVISION: u64 = 6;

/// Everything in the data space of one device.
#[derive(Debug, Clone)]
pub(super) struct Space {
    sram: [u8; SRAM_LEN],
    eeprom: [u8; EEPROM_LEN],
    /// Whether something has happened that the device has to look at.
    pub(super) attention: bool,
    /// Tick at which the instruction began.
    pub(super) now: u64,
    /// Cycles that the instruction has waited for memory.
    pub(super) wait_cycles: u32,
    pub(super) ticks_per_cycle: u64,
    /// Whether SLEEP sleeps.
    pub(super) sleeps: bool,
    /// Whether the program has asked for a reset.
    pub(super) reset_requested: bool,
    pub(super) ccp: Ccp,
    pub(super) cpuint: Cpuint,
    pub(super) clock: ClockPin,
    pub(super) dac: Dac,
    pub(super) tca: Tca,
    pub(super) twi: Twi,
    pub(super) faults: Faults,
}

impl Space {
    /// Memory with `eeprom` at the start of the EEPROM. SRAM holds a pattern: what it holds after power-on is
    /// undefined.
    pub(super) fn new(eeprom: &[u8]) -> Self {
        let byte = |k| eeprom.get(k).copied().unwrap_or(u8::MAX);
        Self {
            sram: std::array::from_fn(|k| (k.to_le_bytes()[0]).wrapping_mul(0x9d) ^ 0xa5),
            eeprom: std::array::from_fn(byte),
            attention: true,
            now: 0,
            wait_cycles: 0,
            ticks_per_cycle: RESET_DIVISION,
            sleeps: false,
            reset_requested: false,
            ccp: Ccp::default(),
            cpuint: Cpuint::default(),
            clock: ClockPin::default(),
            dac: Dac::default(),
            tca: Tca::default(),
            twi: Twi::default(),
            faults: Faults::default(),
        }
    }

    /// Peripherals as after a reset. SRAM and EEPROM stay.
    pub(super) fn reset(&mut self) {
        *self = Self {
            sram: self.sram,
            now: self.now,
            clock: self.clock.after_reset(),
            dac: self.dac.after_reset(),
            faults: self.faults,
            ..Self::new(&self.eeprom)
        };
    }

    /// Requests of all interrupts, bit k that of vector k.
    pub(super) fn requests(&self) -> u32 {
        let port = u32::from(self.clock.flag) << PORT_VECTOR;
        let tca = u32::from(self.tca.requests()) << tca::VECTOR;
        let twi = u32::from(self.twi.requests()) << twi::VECTOR;
        port | tca | twi
    }

    pub(super) fn advance_timer(&mut self, now: u64) {
        self.tca.advance(now, self.ticks_per_cycle);
    }

    #[inline(never)]
    fn read_io(&mut self, address: u16) -> u8 {
        let value = match address {
            VPORT_INTFLAGS => Some(if self.clock.flag { CLOCK_BIT } else { 0 }),
            DAC_DATA => Some(self.dac.data),
            twi::BASE..=twi::END => {
                self.attention = true;
                self.twi.read(address)
            }
            EEPROM..=EEPROM_END => {
                self.wait_cycles += 1;
                self.attention = true;
                Some(self.eeprom[usize::from(address - EEPROM)])
            }
            _ => None,
        };
        value.unwrap_or_else(|| {
            self.faults.record(Fault::Read { address });
            0
        })
    }

    #[inline(never)]
    fn write_io(&mut self, address: u16, value: u8) {
        self.attention = true;
        if let Err(fault) = self.written(address, value) {
            self.faults.record(fault);
        }
        if address != CCP {
            self.ccp.close();
        }
    }

    fn written(&mut self, address: u16, value: u8) -> Result<(), Fault> {
        match address {
            CCP => self.ccp.write(value),
            RSTCTRL_SWRR => {
                self.ccp.check(address)?;
                self.reset_requested = value & 1 != 0;
            }
            SLPCTRL_CTRLA if value <= 1 => self.sleeps = value == 1,
            CLKCTRL_MCLKCTRLB => {
                self.ccp.check(address)?;
                if value != 0 {
                    return Err(Fault::Write { address, value });
                }
                self.ticks_per_cycle = 1;
            }
            CPUINT_LVL1VEC => self.cpuint.level1_vector = value,
            PORT_PIN3CTRL if self.clock.control(value) => {}
            // of analogue meaning alone
            VREF_CTRLA | PORT_PIN6CTRL => {}
            DAC_CTRLA => self.dac.write_control(value),
            DAC_DATA => self.dac.write_data(value),
            twi::BASE..=twi::END => return self.twi.write(address, value),
            tca::BASE..=tca::END => {
                self.advance_timer(self.now);
                return self.tca.write(address, value, self.now);
            }
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }
}

impl DataSpace for Space {
    #[inline]
    fn read(&mut self, address: u16) -> u8 {
        if address >> 8 == SRAM_PAGE { self.sram[usize::from(address & 0xff)] } else { self.read_io(address) }
    }

    #[inline]
    fn write(&mut self, address: u16, value: u8) {
        if address >> 8 == SRAM_PAGE {
            self.sram[usize::from(address & 0xff)] = value;
            self.ccp.close();
        } else if address == VPORT_INTFLAGS {
            self.clock.flag &= value & CLOCK_BIT == 0;
            self.ccp.close();
            self.attention = true;
        } else {
            self.write_io(address, value);
        }
    }

    #[inline]
    fn write_bit(&mut self, address: u16, mask: u8, set: bool) {
        // flags: a one clears its own, a zero does nothing
        let old = if address == VPORT_INTFLAGS { 0 } else { self.read(address) };
        self.write(address, if set { old | mask } else { old & !mask });
    }
}
