//! Pins: PA3, the clock of the cells, and DAC0, whose output is PA6.

/// Vector of PORTA.
pub(super) const PORT_VECTOR: u8 = 3;
/// Bit of the clock pin in PORTA's registers.
pub(super) const CLOCK_BIT: u8 = 1 << 3;

/// Which edges of the clock pin request an interrupt, as PIN3CTRL says.
mod isc {
    pub(super) const BOTH_EDGES: u8 = 1;
    pub(super) const RISING: u8 = 2;
    pub(super) const FALLING: u8 = 3;
}

/// The clock pin.
#[derive(Debug, Clone, Default)]
pub(super) struct ClockPin {
    sense: u8,
    high: bool,
    /// Its bit of PORTA's INTFLAGS.
    pub(super) flag: bool,
}

impl ClockPin {
    /// The pin after a reset: its level is that of the world outside.
    pub(super) fn after_reset(&self) -> Self {
        Self { high: self.high, ..Self::default() }
    }

    /// Writes PIN3CTRL. `false` for what is not emulated.
    pub(super) fn control(&mut self, value: u8) -> bool {
        let known = value <= isc::FALLING;
        if known {
            self.sense = value;
        }
        known
    }

    /// Sets the level outside. Two edges before the flag is cleared are one.
    pub(super) fn set(&mut self, high: bool) {
        self.flag |= high != self.high
            && match self.sense {
                isc::BOTH_EDGES => true,
                isc::RISING => high,
                isc::FALLING => !high,
                _ => false,
            };
        self.high = high;
    }
}

// CTRLA
const ENABLE: u8 = 0x01;
const OUTEN: u8 = 0x40;

/// Code on the pin; `None` when the DAC does not drive it.
type Output = Option<u8>;

/// DAC0.
#[derive(Debug, Clone, Default)]
pub(super) struct Dac {
    drives: bool,
    pub(super) data: u8,
    /// Output before the last write.
    before: Output,
    written_at: u64,
    /// Whether the instruction that wrote has not ended.
    fresh: bool,
}

impl Dac {
    pub(super) fn write_control(&mut self, value: u8) {
        self.prepare();
        self.drives = value & (ENABLE | OUTEN) == ENABLE | OUTEN;
    }

    pub(super) fn write_data(&mut self, value: u8) {
        self.prepare();
        self.data = value;
    }

    fn prepare(&mut self) {
        self.before = self.output();
        self.fresh = true;
    }

    /// The end of an instruction, at `tick`: what it wrote is out from there on.
    pub(super) fn settle(&mut self, tick: u64) {
        if self.fresh {
            self.fresh = false;
            self.written_at = tick;
        }
    }

    pub(super) fn after_reset(&self) -> Self {
        Self { before: self.output(), fresh: true, written_at: self.written_at, ..Self::default() }
    }

    pub(super) fn output(&self) -> Output {
        self.drives.then_some(self.data)
    }

    /// Output at `tick`, which is not before the write before the last.
    pub(super) fn output_at(&self, tick: u64) -> Output {
        if self.written_at > tick { self.before } else { self.output() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sense_fires_on_its_edges() {
        for (sense, expected) in [
            (0, [false, false, false, false]),
            (isc::BOTH_EDGES, [true, false, true, true]),
            (isc::RISING, [true, false, false, true]),
            (isc::FALLING, [false, false, true, false]),
        ] {
            let mut pin = ClockPin::default();
            assert!(pin.control(sense) && !pin.control(5));
            let fired = [true, true, false, true].map(|high| {
                pin.set(high);
                std::mem::take(&mut pin.flag)
            });
            assert_eq!(fired, expected, "ISC {sense}");
        }
    }

    #[test]
    fn a_code_is_out_from_the_end_of_the_write() {
        let mut dac = Dac::default();
        dac.write_control(ENABLE);
        dac.write_data(9);
        dac.settle(90);
        assert_eq!(dac.output(), None);
        dac.write_control(ENABLE | OUTEN);
        dac.settle(100);
        dac.write_data(200);
        dac.settle(150);
        dac.settle(160);
        assert_eq!([149, 150].map(|tick| dac.output_at(tick)), [Some(9), Some(200)]);
    }
}
