//! One emulated cell, edge by edge, with the time of every update.

use spts_firmware::attiny412::{Device, OSCILLATOR_HZ, TraceRecord};

/// A cell under a clock.
pub(super) struct Edges {
    device: Device,
    /// Ticks of the cell's oscillator between two edges.
    period_ticks: f64,
    start: u64,
    edge: u64,
    level: bool,
}

/// What a cell did between one edge and the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Answer {
    /// DAC code at the end of the period.
    pub(super) code: u8,
    /// Ticks from the edge to the last update of the DAC; `None` without an update.
    pub(super) latency_ticks: Option<u64>,
}

impl Edges {
    /// `device`, whose clock line is low, under a clock of `edge_hz` edges a second.
    pub(super) fn new(device: Device, edge_hz: f64) -> Self {
        let start = device.now() + SETTLED_TICKS;
        Self {
            level: false,
            device,
            period_ticks: OSCILLATOR_HZ / edge_hz,
            start,
            edge: 0,
        }
    }

    /// The same cell under another clock from now on.
    pub(super) fn at(self, edge_hz: f64) -> Self {
        Self {
            level: self.level,
            ..Self::new(self.device, edge_hz)
        }
    }

    /// The cell when it has done all that the edges so far have asked for.
    pub(super) fn settled(self) -> Device {
        let mut device = self.device;
        device.run_until(device.now() + SETTLED_TICKS);
        device
    }

    /// One edge with every step of the cell passed on to `line`.
    pub(super) fn traced(&mut self, line: &mut dyn FnMut(&TraceRecord)) {
        let now = self.tick(self.edge);
        self.device.trace_until(now, &mut *line);
        self.toggle();
        self.device.trace_until(self.tick(self.edge), line);
    }

    fn toggle(&mut self) {
        self.level = !self.level;
        self.device.set_clock(self.level);
        self.edge += 1;
    }

    #[expect(clippy::cast_possible_truncation, reason = "ticks of seconds stay far below 2^52")]
    fn tick(&self, edge: u64) -> u64 {
        self.start + (edge as f64 * self.period_ticks).round() as u64
    }
}

/// Time between a write over the bus and the first edge, ticks.
const SETTLED_TICKS: u64 = 2000;

impl Iterator for Edges {
    type Item = Answer;

    /// Gives one edge; never ends.
    fn next(&mut self) -> Option<Answer> {
        let now = self.tick(self.edge);
        self.device.run_until(now);
        self.toggle();
        self.device.run_until(self.tick(self.edge));
        let written = self.device.dac_written_at();
        Some(Answer {
            code: self.device.dac_code(),
            latency_ticks: written.checked_sub(now).filter(|ticks| *ticks > 0),
        })
    }
}
