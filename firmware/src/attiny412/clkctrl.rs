//! Main clock and its prescaler.

use super::ccp::{Ccp, Key};
use super::fault::Fault;

/// First address.
pub(super) const BASE: u16 = 0x0060;
/// Addresses from the first on.
pub(super) const LEN: u16 = 0x20;

const MCLKCTRLA: u16 = BASE;
const MCLKCTRLB: u16 = BASE + 1;
const MCLKLOCK: u16 = BASE + 2;
const MCLKSTATUS: u16 = BASE + 3;
/// MCLKCTRLB: prescaler on.
const PEN: u8 = 0x01;
/// MCLKLOCK: registers locked until the next reset.
const LOCKEN: u8 = 0x01;
/// MCLKSTATUS: the 20 MHz oscillator is stable.
const OSC20MS: u8 = 0x10;
/// MCLKCTRLB out of reset: prescaler on, division by 6.
const MCLKCTRLB_RESET: u8 = 0x11;

/// Registers of CLKCTRL. The main clock is the internal 20 MHz oscillator; other sources are not emulated.
#[derive(Debug, Clone)]
pub(super) struct Clkctrl {
    mclkctrlb: u8,
    lock: u8,
    ticks_per_cycle: u64,
}

impl Default for Clkctrl {
    fn default() -> Self {
        Self {
            mclkctrlb: MCLKCTRLB_RESET,
            lock: 0,
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
            MCLKLOCK => Some(self.lock),
            MCLKSTATUS => Some(OSC20MS),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8, ccp: &Ccp) -> Result<(), Fault> {
        if !matches!(address, MCLKCTRLA | MCLKCTRLB | MCLKLOCK) {
            return Err(Fault::Write { address, value });
        }
        ccp.check(Key::Ioreg, address)?;
        if self.lock & LOCKEN != 0 {
            return Err(Fault::Protected { address });
        }
        match address {
            MCLKCTRLA if value != 0 => return Err(Fault::Unsupported { address, value }),
            MCLKCTRLB => {
                self.ticks_per_cycle = division(value).ok_or(Fault::Unsupported { address, value })?;
                self.mclkctrlb = value & 0x1f;
            }
            MCLKLOCK => self.lock = value & LOCKEN,
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

#[cfg(test)]
mod tests {
    use super::*;

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
        clock.write(MCLKLOCK, 1, &ccp).unwrap();
        assert!(clock.write(MCLKCTRLB, 1, &ccp).is_err());
        assert!(Clkctrl::default().write(MCLKCTRLB, 0, &Ccp::default()).is_err());
    }
}
