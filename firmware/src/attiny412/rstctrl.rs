//! Reset controller.

use super::ccp::{Ccp, Key};
use super::fault::Fault;

/// First address.
pub(super) const BASE: u16 = 0x0040;
/// Addresses from the first on.
pub(super) const LEN: u16 = 2;

const RSTFR: u16 = BASE;
const SWRR: u16 = BASE + 1;

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
                ccp.check(Key::Ioreg, address)?;
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
