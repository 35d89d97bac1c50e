//! DAC0, whose output is pin PA6.

/// First address.
pub(super) const BASE: u16 = 0x0680;
/// Addresses from the first on.
pub(super) const LEN: u16 = 2;

const CTRLA: u16 = BASE;
const ENABLE: u8 = 0x01;
const OUTEN: u8 = 0x40;
const RUNSTDBY: u8 = 0x80;

/// Code on the pin: `None` while the DAC does not drive it.
type Output = Option<u8>;

/// Registers of DAC0 and when its output last changed.
#[derive(Debug, Clone, Default)]
pub(super) struct Dac {
    ctrla: u8,
    data: u8,
    before: Output,
    written_at: u64,
    /// Whether the present instruction has written to the DAC.
    fresh: bool,
}

impl Dac {
    pub(super) fn read(&self, address: u16) -> u8 {
        if address == CTRLA { self.ctrla } else { self.data }
    }

    pub(super) fn write(&mut self, address: u16, value: u8) {
        self.before = self.output();
        self.fresh = true;
        if address == CTRLA {
            self.ctrla = value & (ENABLE | OUTEN | RUNSTDBY);
        } else {
            self.data = value;
        }
    }

    /// The instruction that wrote ends at `tick`.
    pub(super) fn settle(&mut self, tick: u64) {
        if self.fresh {
            self.fresh = false;
            self.written_at = tick;
        }
    }

    /// Registers after a reset; what was on the pin before it is remembered.
    pub(super) fn after_reset(&self) -> Self {
        Self {
            before: self.output(),
            fresh: true,
            written_at: self.written_at,
            ..Self::default()
        }
    }

    /// DATA register.
    pub(super) fn data(&self) -> u8 {
        self.data
    }

    /// Tick at the end of the last instruction that wrote to the DAC.
    pub(super) fn written_at(&self) -> u64 {
        self.written_at
    }

    /// Code on the pin now.
    pub(super) fn output(&self) -> Output {
        (self.ctrla & (ENABLE | OUTEN) == ENABLE | OUTEN).then_some(self.data)
    }

    /// Code on the pin at `tick`, no earlier than the last write but one.
    pub(super) fn output_at(&self, tick: u64) -> Output {
        if self.written_at > tick {
            self.before
        } else {
            self.output()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_out_from_the_end_of_the_write() {
        let mut dac = Dac::default();
        dac.write(CTRLA, ENABLE);
        dac.write(BASE + 1, 9);
        dac.settle(90);
        assert_eq!(dac.output(), None);
        dac.write(CTRLA, ENABLE | OUTEN);
        dac.settle(100);
        dac.write(BASE + 1, 200);
        dac.settle(150);
        dac.settle(160);
        assert_eq!(
            (dac.output_at(149), dac.output_at(150), dac.written_at()),
            (Some(9), Some(200), 150)
        );
    }
}
