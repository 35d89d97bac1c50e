//! Memory map: the peripheral at each address.

use super::pins::{DAC, DAC_END, Dac, PORT, PORT_END, PORT_VECTOR, Port, VPORT_LEN, VREF, VREF_END, Vref};
use super::system::{
    CLKCTRL, CLKCTRL_END, CPUINT, CPUINT_END, Ccp, Clkctrl, Cpuint, Fault, Faults, RSTCTRL, RSTCTRL_END, ResetCause,
    Rstctrl, SLPCTRL_CTRLA, Slpctrl,
};
use super::tca::{self, Tca};
use super::twi::{self, Twi};
use crate::avr::{DataSpace, Program};
use std::sync::Arc;

/// Size of the SRAM (bytes).
const SRAM_LEN: usize = 256;
/// High byte of every SRAM address, 0x3F00…0x3FFF.
const SRAM_PAGE: u16 = 0x3f;
/// Last address of SRAM, where the stack starts.
pub(super) const RAM_END: u16 = 0x3fff;
/// General purpose I/O registers.
const GPIO: u16 = 0x1c;
const GPIO_END: u16 = GPIO + 3;
const CCP: u16 = 0x34;
const SIGNATURE: u16 = 0x1100;
const EEPROM: u16 = 0x1400;
/// Size of the EEPROM (bytes).
const EEPROM_LEN: usize = 128;
/// Identifies an ATtiny412.
const SIGNATURE_BYTES: [u8; 3] = [0x1e, 0x92, 0x23];
const FLASH: u16 = 0x8000;
/// Size of the flash (bytes).
pub(super) const FLASH_LEN: u16 = 0x1000;

const EEPROM_END: u16 = EEPROM + 0x7f;
const SIGNATURE_END: u16 = SIGNATURE + 2;
const FLASH_END: u16 = FLASH + FLASH_LEN - 1;

/// Everything with an address but the CPU's own registers.
#[derive(Debug, Clone)]
pub(super) struct Space {
    sram: [u8; SRAM_LEN],
    gpio: [u8; 4],
    eeprom: [u8; EEPROM_LEN],
    /// Whether a register was accessed that may change interrupts, clock or the time of the next event.
    pub(super) attention: bool,
    /// Tick at which the present instruction started.
    pub(super) now: u64,
    /// Cycles that the present instruction waits for flash or EEPROM; non-zero only with `attention`.
    pub(super) wait_cycles: u32,
    pub(super) ccp: Ccp,
    pub(super) clkctrl: Clkctrl,
    pub(super) cpuint: Cpuint,
    pub(super) dac: Dac,
    pub(super) port: Port,
    pub(super) rstctrl: Rstctrl,
    pub(super) slpctrl: Slpctrl,
    pub(super) tca: Tca,
    pub(super) twi: Twi,
    pub(super) vref: Vref,
    pub(super) faults: Faults,
    program: Arc<Program>,
}

impl Space {
    /// Memory with `eeprom` at the start of the EEPROM. SRAM holds a pattern: what it holds after power-on is
    /// undefined.
    pub(super) fn new(program: Arc<Program>, eeprom: &[u8]) -> Self {
        let byte = |k| eeprom.get(k).copied().unwrap_or(u8::MAX);
        Self {
            sram: power_on_pattern(),
            gpio: [0; 4],
            eeprom: std::array::from_fn(byte),
            attention: true,
            now: 0,
            wait_cycles: 0,
            ccp: Ccp::default(),
            clkctrl: Clkctrl::default(),
            cpuint: Cpuint::default(),
            dac: Dac::default(),
            port: Port::default(),
            rstctrl: Rstctrl::default().after(ResetCause::PowerOn),
            slpctrl: Slpctrl::default(),
            tca: Tca::default(),
            twi: Twi::default(),
            vref: Vref::default(),
            faults: Faults::default(),
            program,
        }
    }

    /// Peripherals as after a reset by `cause`; EEPROM and, except at power-on, SRAM stay.
    pub(super) fn reset(&mut self, cause: ResetCause) {
        let mut fresh = Self::new(Arc::clone(&self.program), &self.eeprom);
        if cause != ResetCause::PowerOn {
            fresh.sram = self.sram;
        }
        fresh.now = self.now;
        fresh.port = self.port.after_reset();
        fresh.rstctrl = self.rstctrl.after(cause);
        fresh.dac = self.dac.after_reset();
        fresh.faults = self.faults;
        *self = fresh;
    }

    /// SRAM, 0x3F00…0x3FFF.
    pub(super) fn sram(&self) -> &[u8; SRAM_LEN] {
        &self.sram
    }

    /// Interrupts asked for, bit = vector number.
    pub(super) fn requests(&self) -> u32 {
        let port = u32::from(self.port.flags() != 0) << PORT_VECTOR;
        let tca = u32::from(self.tca.requests()) << tca::VECTOR;
        let twi = u32::from(self.twi.requests()) << twi::VECTOR;
        port | tca | twi
    }

    /// Brings the timer to the present with the present clock.
    pub(super) fn advance_timer(&mut self, now: u64) {
        self.tca.advance(now, self.clkctrl.ticks_per_cycle());
    }

    /// An access to memory that is not SRAM: one more cycle at least (DS40002198, notes to the cycles), here always
    /// one.
    fn wait_for_memory(&mut self) {
        self.ccp.close();
        self.wait_cycles += 1;
        self.attention = true;
    }

    #[inline(never)]
    fn read_io(&mut self, address: u16) -> u8 {
        let value = match address {
            GPIO..=GPIO_END => Some(self.gpio[usize::from(address - GPIO)]),
            CCP => Some(self.ccp.read()),
            RSTCTRL..=RSTCTRL_END => Some(self.rstctrl.read(address)),
            SLPCTRL_CTRLA => Some(self.slpctrl.read()),
            CLKCTRL..=CLKCTRL_END => self.clkctrl.read(address),
            VREF..=VREF_END => self.vref.read(address),
            CPUINT..=CPUINT_END => self.cpuint.read(address),
            PORT..=PORT_END => self.port.read(address),
            DAC..=DAC_END => Some(self.dac.read(address)),
            twi::BASE..=twi::END => {
                self.attention = true;
                self.twi.read(address)
            }
            tca::BASE..=tca::END => {
                self.advance_timer(self.now);
                self.attention = true;
                self.tca.read(address)
            }
            EEPROM..=EEPROM_END => {
                self.wait_for_memory();
                Some(self.eeprom[usize::from(address - EEPROM)])
            }
            SIGNATURE..=SIGNATURE_END => {
                self.wait_for_memory();
                Some(SIGNATURE_BYTES[usize::from(address - SIGNATURE)])
            }
            FLASH..=FLASH_END => {
                self.wait_for_memory();
                Some(self.program.byte(address - FLASH))
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
        let unmapped = Err(Fault::Write { address, value });
        let outcome = match address {
            GPIO..=GPIO_END => {
                self.gpio[usize::from(address - GPIO)] = value;
                Ok(())
            }
            CCP => {
                self.ccp.write(value);
                Ok(())
            }
            RSTCTRL..=RSTCTRL_END => self.rstctrl.write(address, value, &self.ccp),
            SLPCTRL_CTRLA => self.slpctrl.write(value),
            CLKCTRL..=CLKCTRL_END => {
                self.advance_timer(self.now);
                self.clkctrl.write(address, value, &self.ccp)
            }
            VREF..=VREF_END => {
                self.vref.write(address, value);
                Ok(())
            }
            CPUINT..=CPUINT_END => self.cpuint.write(address, value),
            PORT..=PORT_END if self.port.write(address, value) => Ok(()),
            DAC..=DAC_END => {
                self.dac.write(address, value);
                Ok(())
            }
            twi::BASE..=twi::END => self.twi.write(address, value),
            tca::BASE..=tca::END => {
                self.advance_timer(self.now);
                self.tca.write(address, value, self.now)
            }
            _ => unmapped,
        };
        if address != CCP {
            self.ccp.close();
        }
        if let Err(fault) = outcome {
            self.faults.record(fault);
        }
    }
}

impl DataSpace for Space {
    #[inline]
    fn read(&mut self, address: u16) -> u8 {
        if address >> 8 == SRAM_PAGE {
            self.sram[usize::from(address & 0xff)]
        } else if address < VPORT_LEN {
            self.port.read_mirror(address)
        } else {
            self.read_io(address)
        }
    }

    #[inline]
    fn write(&mut self, address: u16, value: u8) {
        if address >> 8 == SRAM_PAGE {
            self.sram[usize::from(address & 0xff)] = value;
            self.ccp.close();
        } else if address < VPORT_LEN {
            self.port.write_mirror(address, value);
            self.ccp.close();
            self.attention = true;
        } else {
            self.write_io(address, value);
        }
    }

    #[inline]
    fn write_bit(&mut self, address: u16, mask: u8, set: bool) {
        if matches!(address, 2 | 3) {
            // IN and INTFLAGS: a one toggles or clears its own pin, a zero does nothing
            self.write(address, if set { mask } else { 0 });
        } else {
            let old = self.read(address);
            self.write(address, if set { old | mask } else { old & !mask });
        }
    }
}

/// Bytes that no program would leave behind: each differs from its neighbours.
fn power_on_pattern() -> [u8; SRAM_LEN] {
    std::array::from_fn(|k| (k.to_le_bytes()[0]).wrapping_mul(0x9d) ^ 0xa5)
}
