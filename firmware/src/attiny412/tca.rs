//! Timer TCA0 in normal mode: counts up to PER and sets its overflow flag.

use super::system::Fault;

/// Vector of the overflow.
pub(super) const VECTOR: u8 = 8;

const CTRLA: u16 = 0x0a00;
const INTCTRL: u16 = 0x0a0a;
const INTFLAGS: u16 = 0x0a0b;
const PERL: u16 = 0x0a26;
const PERH: u16 = 0x0a27;
pub(super) const BASE: u16 = CTRLA;
pub(super) const END: u16 = PERH;

const ENABLE: u8 = 0x01;
const OVF: u8 = 0x01;
/// Cycles a count for every value of CLKSEL.
const DIVISIONS: [u64; 8] = [1, 2, 4, 8, 16, 64, 256, 1024];

/// The timer. The main clock is set before it starts.
#[derive(Debug, Clone)]
pub(super) struct Tca {
    ctrla: u8,
    enabled: bool,
    overflowed: bool,
    /// Low byte of PER until the high one is written.
    temp: u8,
    per: u16,
    /// Tick at which the count was 0 last.
    since: u64,
}

impl Default for Tca {
    fn default() -> Self {
        Self { ctrla: 0, enabled: false, overflowed: false, temp: 0, per: u16::MAX, since: 0 }
    }
}

impl Tca {
    pub(super) fn requests(&self) -> bool {
        self.overflowed && self.enabled
    }

    /// Tick of the next overflow; `None` while the timer stands.
    pub(super) fn next_overflow(&self, ticks_per_cycle: u64) -> Option<u64> {
        let period = self.period(ticks_per_cycle);
        (self.ctrla & ENABLE != 0).then(|| self.since + period)
    }

    /// Brings the timer to the tick `now`.
    pub(super) fn advance(&mut self, now: u64, ticks_per_cycle: u64) {
        if self.next_overflow(ticks_per_cycle).is_some_and(|next| next <= now) {
            let period = self.period(ticks_per_cycle);
            self.overflowed = true;
            self.since += (now - self.since) / period * period;
        }
    }

    /// Writes a register; the timer has been brought to `now`.
    pub(super) fn write(&mut self, address: u16, value: u8, now: u64) -> Result<(), Fault> {
        match address {
            CTRLA => (self.ctrla, self.since) = (value, now),
            INTCTRL => self.enabled = value & OVF != 0,
            INTFLAGS => self.overflowed &= value & OVF == 0,
            PERL => self.temp = value,
            PERH => self.per = u16::from_le_bytes([self.temp, value]),
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    fn period(&self, ticks_per_cycle: u64) -> u64 {
        (u64::from(self.per) + 1) * DIVISIONS[usize::from(self.ctrla >> 1 & 7)] * ticks_per_cycle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The period of an Arduino core's millisecond timer: 64 · 255 cycles.
    #[test]
    fn overflows_come_every_period_times_division() {
        let mut timer = Tca::default();
        for (address, value) in [(PERL, 254), (PERH, 0), (INTCTRL, OVF), (CTRLA, 5 << 1 | ENABLE)] {
            timer.write(address, value, 100).unwrap();
        }
        for k in 1..5 {
            let tick = 100 + k * 64 * 255;
            assert_eq!(timer.next_overflow(1), Some(tick));
            timer.advance(tick - 1, 1);
            assert!(!timer.requests());
            timer.advance(tick, 1);
            assert!(timer.requests());
            timer.write(INTFLAGS, OVF, tick).unwrap();
        }
        timer.advance(100 + 64 * 255 * 9 + 64 * 7 + 63, 1);
        assert_eq!(timer.next_overflow(1), Some(100 + 64 * 255 * 10));
        assert!(timer.write(BASE + 1, 1, 0).is_err());
    }
}
