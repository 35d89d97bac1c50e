//! Timer TCA0 in normal mode: counts up to PER and sets its overflow flag.

use super::system::Fault;

/// First and last address.
pub(super) const BASE: u16 = 0x0a00;
pub(super) const END: u16 = 0x0a27;
/// Interrupt vector of the overflow.
pub(super) const VECTOR: u8 = 8;

const CTRLA: u16 = BASE;
const CTRLB: u16 = BASE + 0x01;
const CTRLD: u16 = BASE + 0x03;
const CTRLESET: u16 = BASE + 0x05;
const INTCTRL: u16 = BASE + 0x0a;
const INTFLAGS: u16 = BASE + 0x0b;
const TEMP: u16 = BASE + 0x0f;
const CNTL: u16 = BASE + 0x20;
const CNTH: u16 = BASE + 0x21;
const PERL: u16 = BASE + 0x26;
const PERH: u16 = BASE + 0x27;

const ENABLE: u8 = 0x01;
const OVF: u8 = 0x01;
/// Commands of CTRLESET: restart the count, reset the registers.
const RESTART: u8 = 0x02 << 2;
const RESET: u8 = 0x03 << 2;
/// Divisions of CLKSEL.
const DIVISIONS: [u64; 8] = [1, 2, 4, 8, 16, 64, 256, 1024];

/// Registers of TCA0. The count is computed from the tick at which it was last known, not stepped.
#[derive(Debug, Clone)]
pub(super) struct Tca {
    ctrla: u8,
    intctrl: u8,
    flags: u8,
    temp: u8,
    per: u16,
    /// Count at tick `since`.
    count: u16,
    since: u64,
    ticks_per_cycle: u64,
}

impl Default for Tca {
    fn default() -> Self {
        Self {
            ctrla: 0,
            intctrl: 0,
            flags: 0,
            temp: 0,
            per: u16::MAX,
            count: 0,
            since: 0,
            ticks_per_cycle: 6,
        }
    }
}

impl Tca {
    /// Whether the overflow asks for an interrupt.
    pub(super) fn requests(&self) -> bool {
        self.flags & self.intctrl & OVF != 0
    }

    /// Tick at which the count next goes from PER to 0.
    pub(super) fn next_overflow(&self) -> Option<u64> {
        self.running()
            .then(|| self.since + self.counts_to_wrap() * self.ticks_per_count())
    }

    /// Brings count and flag up to `now`; from there on a CPU cycle lasts `ticks_per_cycle`.
    pub(super) fn advance(&mut self, now: u64, ticks_per_cycle: u64) {
        if self.running() {
            let counts = now.saturating_sub(self.since) / self.ticks_per_count();
            self.since += counts * self.ticks_per_count();
            let to_wrap = self.counts_to_wrap();
            if counts >= to_wrap {
                self.flags |= OVF;
                self.count = low((counts - to_wrap) % (u64::from(self.per) + 1));
            } else {
                self.count = low(u64::from(self.count) + counts);
            }
        } else {
            self.since = now;
        }
        self.ticks_per_cycle = ticks_per_cycle;
    }

    /// Register as read; the caller has brought the timer up to the present.
    pub(super) fn read(&mut self, address: u16) -> Option<u8> {
        let wide = |value: u16, temp: &mut u8| {
            let [low, high] = value.to_le_bytes();
            *temp = high;
            Some(low)
        };
        match address {
            CTRLA => Some(self.ctrla),
            CTRLB | CTRLD => Some(0),
            INTCTRL => Some(self.intctrl),
            INTFLAGS => Some(self.flags),
            CNTL => wide(self.count, &mut self.temp),
            PERL => wide(self.per, &mut self.temp),
            TEMP | CNTH | PERH => Some(self.temp),
            _ => None,
        }
    }

    /// Writes a register; the caller has brought the timer up to the present.
    pub(super) fn write(&mut self, address: u16, value: u8, now: u64) -> Result<(), Fault> {
        match address {
            CTRLA => {
                if !self.running() || value >> 1 != self.ctrla >> 1 {
                    self.since = now;
                }
                self.ctrla = value & 0x0f;
            }
            CTRLB | CTRLD if value == 0 => {}
            CTRLB | CTRLD => return Err(Fault::Unsupported { address, value }),
            CTRLESET if value == RESTART => (self.count, self.since) = (0, now),
            CTRLESET if value == RESET && !self.running() => {
                *self = Self {
                    since: now,
                    ticks_per_cycle: self.ticks_per_cycle,
                    ..Self::default()
                };
            }
            CTRLESET => return Err(Fault::Unsupported { address, value }),
            INTCTRL if value & !OVF == 0 => self.intctrl = value,
            INTCTRL => return Err(Fault::Unsupported { address, value }),
            INTFLAGS => self.flags &= !value,
            TEMP | CNTL | PERL => self.temp = value,
            CNTH => (self.count, self.since) = (u16::from_le_bytes([self.temp, value]), now),
            PERH => self.per = u16::from_le_bytes([self.temp, value]),
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    fn running(&self) -> bool {
        self.ctrla & ENABLE != 0
    }

    fn ticks_per_count(&self) -> u64 {
        DIVISIONS[usize::from(self.ctrla >> 1 & 7)] * self.ticks_per_cycle
    }

    /// Counts until the count is 0 next. Above PER it first runs through the 16-bit range.
    fn counts_to_wrap(&self) -> u64 {
        let top = if self.count > self.per { u16::MAX } else { self.per };
        u64::from(top - self.count) + 1
    }
}

/// Low 16 bits.
fn low(value: u64) -> u16 {
    let [a, b, ..] = value.to_le_bytes();
    u16::from_le_bytes([a, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The period of an Arduino core's millisecond timer: 64 · 255 cycles.
    #[test]
    fn overflows_come_every_period_times_division() {
        let mut timer = Tca::default();
        timer.advance(0, 1);
        timer.write(PERL, 254, 0).unwrap();
        timer.write(PERH, 0, 0).unwrap();
        timer.write(INTCTRL, OVF, 0).unwrap();
        timer.write(CTRLA, 5 << 1 | ENABLE, 100).unwrap();
        for k in 1..5 {
            let tick = 100 + k * 64 * 255;
            assert_eq!(timer.next_overflow(), Some(tick));
            timer.advance(tick - 1, 1);
            assert!(!timer.requests());
            assert_eq!(timer.read(CNTL), Some(254));
            timer.advance(tick, 1);
            assert!(timer.requests());
            assert_eq!(timer.read(CNTL), Some(0));
            timer.write(INTFLAGS, OVF, tick).unwrap();
        }
        timer.advance(100 + 64 * 255 * 9 + 64 * 7 + 63, 1);
        assert_eq!(timer.read(CNTL), Some(7));
    }

    #[test]
    fn sixteen_bits_go_through_temp() {
        let mut timer = Tca::default();
        for (address, value) in [(CNTL, 0x34), (CNTH, 0x12), (PERL, 0x78), (PERH, 0x56)] {
            timer.write(address, value, 0).unwrap();
        }
        let read = [CNTL, CNTH, PERL, PERH].map(|address| timer.read(address));
        assert_eq!(read, [Some(0x34), Some(0x12), Some(0x78), Some(0x56)]);
        assert!(timer.write(CTRLD, 1, 0).is_err());
        assert!(timer.write(BASE + 0x28, 1, 0).is_err());
    }
}
