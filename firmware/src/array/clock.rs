//! The clock line: its edges, and the sampling of codes.

use super::error::ArrayError;
use crate::attiny412::{Device, OSCILLATOR_HZ};
use crate::cell::NEUTRAL_CODE;

/// Rate of the clock line's edges, and the delay from an edge to the sampling of the codes.
///
/// ```
/// use spts_firmware::Clock;
///
/// assert!(Clock::at(64.3e3).check().is_ok());
/// let late = Clock { edge_hz: 64.3e3, sample_delay_s: 20e-6 }; // longer than the period of 15.6 µs
/// assert!(late.check().unwrap_err().to_string().starts_with("`sample_delay_s` = 0.00002"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Edges per second, rising and falling counted equally. Range [1, 1e6].
    pub edge_hz: f64,
    /// Time from an edge to the sampling of the codes, s, rounded to oscillator ticks of 50 ns. Range [0, 1/`edge_hz`),
    /// and at least one tick less than the shortest distance between two edges.
    pub sample_delay_s: f64,
}

/// Rate of the recordings of the skin, edges per second.
pub const SKIN_EDGE_HZ: f64 = 64.3e3;
/// Time from an edge to the converter's sample in the published acquisition code, s.
pub const SKIN_SAMPLE_DELAY_S: f64 = 11e-6;

impl Default for Clock {
    /// The skin's: 64.3 thousand measurements a second, sampled 11 µs behind the edge.
    fn default() -> Self {
        Self {
            edge_hz: SKIN_EDGE_HZ,
            sample_delay_s: SKIN_SAMPLE_DELAY_S,
        }
    }
}

impl Clock {
    /// The skin's clock at another rate. Codes are sampled 11 µs after the edge or, if the period is too short for
    /// that, after the same share of the period.
    #[must_use]
    pub fn at(edge_hz: f64) -> Self {
        Self {
            edge_hz,
            sample_delay_s: SKIN_SAMPLE_DELAY_S * (SKIN_EDGE_HZ / edge_hz).min(1.0),
        }
    }

    /// Checks that the clock line can run at this rate and delay.
    ///
    /// # Errors
    /// [`ArrayError::Clock`], with the field out of range.
    pub fn check(&self) -> Result<(), ArrayError> {
        let error = |field, value, range| Err(ArrayError::Clock { field, value, range });
        if !(1.0..=1e6).contains(&self.edge_hz) {
            return error("edge_hz", self.edge_hz, "[1, 1e6]");
        }
        // edges are the whole part of the period apart, or one tick more, and an edge must not come before the sample;
        // a period that is whole but for rounding counts as whole
        let in_range = (0.0..1.0 / self.edge_hz).contains(&self.sample_delay_s);
        let shortest = (OSCILLATOR_HZ / self.edge_hz * (1.0 + 1e-14)).floor();
        if !in_range || ticks(self.sample_delay_s) as f64 >= shortest {
            return error(
                "sample_delay_s",
                self.sample_delay_s,
                "[0, 1/edge_hz) in whole ticks of 50 ns",
            );
        }
        Ok(())
    }
}

/// A clock that started at tick `origin`. Edge k = 1, 2, … comes at the tick nearest to `origin` + k/f: errors do not
/// add up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Train {
    pub(super) clock: Clock,
    origin: u64,
    sample_delay: u64,
    /// Whether the clock runs freely, also during bus traffic.
    pub(super) free: bool,
}

impl Train {
    pub(super) fn new(clock: Clock, origin: u64, free: bool) -> Self {
        Self {
            clock,
            origin,
            sample_delay: ticks(clock.sample_delay_s),
            free,
        }
    }

    fn edge_tick(&self, edge: u64) -> u64 {
        self.origin + ticks(edge as f64 / self.clock.edge_hz)
    }

    pub(super) fn sample_tick(&self, edge: u64) -> u64 {
        self.edge_tick(edge) + self.sample_delay
    }
}

/// Oscillator ticks nearest to a time.
#[expect(
    clippy::cast_possible_truncation,
    reason = "times are non-negative and end centuries before 2^53 ticks"
)]
pub(super) fn ticks(time_s: f64) -> u64 {
    (time_s * OSCILLATOR_HZ).round() as u64
}

/// How far a cell has followed the clock line, and the codes sampled from it.
#[derive(Debug, Clone, Default)]
pub(super) struct Follower {
    /// Number of edges so far.
    edges: u64,
    /// Tick of the last edge.
    edge_tick: u64,
    /// Tick of the next edge, once computed.
    next_tick: Option<u64>,
    /// Number of edges whose codes have been sampled.
    pub(super) sampled: u64,
    high: bool,
    /// Sampled codes that have not been fetched.
    pub(super) codes: Vec<u8>,
}

/// What the clock brings next.
enum Next {
    Edge,
    Sample,
}

impl Follower {
    /// Starts counting edges anew; the line keeps its level.
    pub(super) fn restart(&mut self) {
        self.edges = 0;
        self.next_tick = None;
        self.sampled = 0;
        self.codes.clear();
    }

    /// The last edge, if its code has not been sampled yet.
    pub(super) fn unsampled(&self) -> Option<u64> {
        (self.sampled < self.edges).then_some(self.edges)
    }

    /// Runs `device` to `tick` through the edges and samples on the way. With `released`, only until its I²C client
    /// does not hold the bus; returns whether it does not.
    pub(super) fn follow(&mut self, device: &mut Device, train: Option<&Train>, tick: u64, released: bool) -> bool {
        while let Some((next, at)) = train.map(|t| self.next(t)).filter(|(_, at)| *at <= tick) {
            if released && device.run_until_released(at) {
                return true;
            }
            device.run_until(at);
            match next {
                Next::Edge => {
                    self.high = !self.high;
                    device.set_clock(self.high);
                    self.edges += 1;
                    self.edge_tick = at;
                    self.next_tick = None;
                }
                Next::Sample => {
                    self.codes.push(device.dac_output_at(at).unwrap_or(NEUTRAL_CODE));
                    self.sampled = self.edges;
                }
            }
        }
        if released {
            device.run_until_released(tick)
        } else {
            device.run_until(tick);
            true
        }
    }

    fn next(&mut self, train: &Train) -> (Next, u64) {
        let edge = self.edges + 1;
        let edge = *self.next_tick.get_or_insert_with(|| train.edge_tick(edge));
        let sample = self.edge_tick + train.sample_delay;
        // the delay is shorter than the period
        if self.sampled < self.edges {
            (Next::Sample, sample)
        } else {
            (Next::Edge, edge)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 MHz / 72 kHz = 277.7…; a rounded period of 278 would be 22 222 ticks late after 100 000 edges.
    #[test]
    fn edges_do_not_drift() {
        let clock = Clock {
            edge_hz: 72e3,
            sample_delay_s: 10e-6,
        };
        let train = Train::new(clock, 1000, false);
        assert_eq!(train.edge_tick(1), 1278);
        assert_eq!(train.edge_tick(2), 1556);
        assert_eq!(train.edge_tick(100_000), 1000 + 27_777_778);
        assert_eq!(train.sample_tick(1), 1478);
    }

    #[test]
    fn impossible_clocks_are_refused() {
        let clock = |edge_hz, sample_delay_s| Clock {
            edge_hz,
            sample_delay_s,
        };
        for bad in [
            clock(0.0, 0.0),
            clock(f64::NAN, 0.0),
            clock(2e6, 0.0),
            clock(1e5, 1e-5),
            // the tick of the next edge
            clock(1e5, 9.99e-6),
            clock(72e3, 277.0 * 50e-9),
            clock(1e5, -1e-9),
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
        for good in [clock(1e5, 9.95e-6), clock(72e3, 276.0 * 50e-9), Clock::default()] {
            good.check().unwrap();
        }
    }
}
