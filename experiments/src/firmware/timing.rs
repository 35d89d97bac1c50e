//! How long after a clock edge a cell's output changes, and how fast a clock the cell follows.

use super::edges::Edges;
use super::plan::Plan;
use crate::cli::CliError;
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::WeightMode;
use spts_firmware::SKIN_EDGE_HZ;
use spts_firmware::attiny412::{Device, OSCILLATOR_HZ};

/// Rate that the skin is designed for, edges a second.
pub const DESIGN_EDGE_HZ: f64 = 72_000.0;

/// Edges of one attempt to keep up; several times the beat of the edges with a timer of 16320 ticks.
const EDGES: usize = 4000;
/// Slow edges that show whether the cell is still in step: a whole raster.
const SLOW_EDGES: usize = 100;
/// Taxel that is looked at: its turn in the raster is inside the run, not at its ends.
pub(super) const TAXEL: usize = 49;
/// Longest period that is tried, ticks.
const LONGEST_TICKS: u32 = 20_000;

/// A clock that every cell follows.
pub(super) const SLOW_HZ: f64 = 5_000.0;

/// One mode of one image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeTiming {
    /// Mode of the cell.
    pub mode: WeightMode,
    /// Longest time from an edge to the new output, CPU cycles at 20 MHz.
    pub latency_cycles: u64,
    /// Shortest.
    pub latency_cycles_min: u64,
    /// Shortest period of edges that loses none, cycles.
    pub least_period_cycles: u32,
    /// Largest rate of edges that loses none, Hz.
    pub max_edge_hz: f64,
    /// What is left of the period at 72 kHz, as a share of the least period: `max_edge_hz`/72 kHz − 1.
    pub margin_at_72_khz: f64,
}

impl Plan {
    /// Latency and largest clock rate in every mode of the plan.
    ///
    /// # Errors
    /// [`CliError::Usage`] when a cell does not answer on the bus, or does not follow even a slow clock.
    pub fn timing(&self) -> Result<Vec<ModeTiming>, CliError> {
        self.modes.par_iter().map(|&mode| self.mode_timing(mode)).collect()
    }

    fn mode_timing(&self, mode: WeightMode) -> Result<ModeTiming, CliError> {
        let device = self.cell(mode, TAXEL)?;
        let lost = || {
            CliError::Usage(format!(
                "image {}: loses edges of any clock in mode {mode:?}",
                self.image_name
            ))
        };
        let mut latencies = Vec::with_capacity(EDGES);
        for answer in Edges::new(device.clone(), SKIN_EDGE_HZ).take(EDGES) {
            latencies.push(answer.latency_ticks.ok_or_else(lost)?);
        }
        let least_period_cycles = self.least_period(mode, &device).ok_or_else(lost)?;
        let max_edge_hz = OSCILLATOR_HZ / f64::from(least_period_cycles);
        Ok(ModeTiming {
            mode,
            latency_cycles: latencies.iter().copied().max().unwrap_or(0),
            latency_cycles_min: latencies.iter().copied().min().unwrap_or(0),
            least_period_cycles,
            max_edge_hz,
            margin_at_72_khz: max_edge_hz / DESIGN_EDGE_HZ - 1.0,
        })
    }

    /// Shortest period, in ticks, at which no edge is lost: by halving, as a cell that follows one clock follows any slower one.
    fn least_period(&self, mode: WeightMode, device: &Device) -> Option<u32> {
        let follows = |ticks: u32| self.follows(mode, device, OSCILLATOR_HZ / f64::from(ticks));
        let (mut short, mut long) = (1, LONGEST_TICKS);
        if !follows(long) {
            return None;
        }
        while long - short > 1 {
            let middle = short.midpoint(long);
            if follows(middle) {
                long = middle;
            } else {
                short = middle;
            }
        }
        Some(long)
    }

    /// Whether the cell is still in step after many edges at `edge_hz`.
    fn follows(&self, mode: WeightMode, device: &Device, edge_hz: f64) -> bool {
        let mut fast = Edges::new(device.clone(), edge_hz);
        fast.by_ref().take(EDGES).for_each(drop);
        let mut expected = vec![0.0; SLOW_EDGES * self.weights(mode).taxels()];
        self.weights(mode).fill_rows(EDGES as u64, &mut expected);
        let expected = expected.chunks_exact(self.weights(mode).taxels()).map(|row| row[TAXEL]);
        let slow = fast.at(SLOW_HZ).take(SLOW_EDGES);
        slow.zip(expected)
            .all(|(answer, level)| mode.code_level(answer.code).to_bits() == level.to_bits())
    }
}
