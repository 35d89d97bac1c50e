//! Sleep controller.

use super::fault::Fault;

/// Address of CTRLA, the only register.
pub(super) const CTRLA: u16 = 0x0050;
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
            return Err(Fault::Unsupported { address: CTRLA, value });
        }
        self.ctrla = value;
        Ok(())
    }

    /// Whether SLEEP stops the CPU.
    pub(super) fn enabled(&self) -> bool {
        self.ctrla & SEN != 0
    }
}
