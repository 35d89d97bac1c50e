//! Updates that come after the converter has sampled.

use super::cells::EmulatedCells;
use super::edges::Edges;
use super::error::FirmwareError;
use super::task::CellTask;
use super::timing::TAXEL;
use crate::calibrate::beat;
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::WeightMode;
use spts_firmware::SKIN_SAMPLE_DELAY_S;
use spts_firmware::attiny412::{Device, OSCILLATOR_HZ};

/// Stretches of the clock, as the presses of a session.
const STRETCHES: u64 = 8;
/// Edges of a stretch: a press of the recordings has as many.
const EDGES: usize = 100_000;
/// Time between two stretches, ticks: 57 frames, as in the recordings.
const GAP_TICKS: u64 = 1_773_000;

/// How often an emulated cell in binary mode sets its new weight after the sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LateUpdates {
    /// Rate of the edges, Hz.
    pub edge_hz: f64,
    /// Time from an edge to the converter's sample, s.
    pub sample_delay_s: f64,
    /// Number of edges at which the level changes.
    pub flips: u64,
    /// Number of those whose new level comes after the sample.
    pub late: u64,
    /// Share of late flips.
    pub late_share: f64,
    /// Period of the late flips, measurements, found as in recordings; `None` without a period.
    pub period_measurements: Option<f64>,
    /// Time from the edge to the new level, ticks of 50 ns, for every flip, sorted.
    #[serde(skip)]
    pub latency_ticks: Vec<u64>,
}

impl LateUpdates {
    /// Share of the flips later than `delay_s` after the edge.
    #[must_use]
    pub fn share_beyond(&self, delay_s: f64) -> f64 {
        let late = self
            .latency_ticks
            .partition_point(|ticks| *ticks as f64 <= delay_s * OSCILLATOR_HZ);
        (self.latency_ticks.len() - late) as f64 / self.latency_ticks.len().max(1) as f64
    }
}

impl EmulatedCells {
    /// Late updates of one binary cell with this image at `edge_hz`.
    ///
    /// # Errors
    /// [`FirmwareError`] if the cell does not answer on the bus.
    pub fn lateness(&self, edge_hz: f64) -> Result<LateUpdates, FirmwareError> {
        let device = self.cell(CellTask::Mode(WeightMode::Binary), TAXEL)?;
        let stretches: Vec<(Vec<u64>, Vec<u64>)> = (0..STRETCHES)
            .into_par_iter()
            .map(|stretch| {
                let mut device = device.clone();
                let gap = device.now() + stretch * GAP_TICKS;
                device.run_until(gap);
                flips(device, edge_hz)
            })
            .collect();
        let events: Vec<Vec<u64>> = stretches.iter().map(|(late, _)| late.clone()).collect();
        let mut latency_ticks: Vec<u64> = stretches.into_iter().flat_map(|(_, latencies)| latencies).collect();
        latency_ticks.sort_unstable();
        let late: u64 = events.iter().map(|rows| rows.len() as u64).sum();
        let flips = latency_ticks.len() as u64;
        let mut lateness = LateUpdates {
            edge_hz,
            sample_delay_s: SKIN_SAMPLE_DELAY_S,
            flips,
            late,
            late_share: 0.0,
            period_measurements: beat(TAXEL, &events).map(|b| b.period_measurements),
            latency_ticks,
        };
        lateness.late_share = lateness.share_beyond(SKIN_SAMPLE_DELAY_S);
        Ok(lateness)
    }
}

/// Rows of the late flips of one stretch, and the latencies of all flips.
fn flips(device: Device, edge_hz: f64) -> (Vec<u64>, Vec<u64>) {
    let (mut late, mut latencies, mut before) = (Vec::new(), Vec::new(), device.dac_code());
    for (row, answer) in (0..).zip(Edges::new(device, edge_hz).take(EDGES)) {
        if let Some(latency) = answer.latency_ticks.filter(|_| answer.code != before) {
            latencies.push(latency);
            if latency as f64 > SKIN_SAMPLE_DELAY_S * OSCILLATOR_HZ {
                late.push(row);
            }
        }
        before = answer.code;
    }
    (late, latencies)
}
