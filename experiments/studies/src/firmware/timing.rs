//! Delay from a clock edge to a cell's new output, and the fastest clock that the cell follows.

use super::cells::EmulatedCells;
use super::edges::Edges;
use super::error::{CellFailure, FirmwareError};
use super::task::CellTask;
use rayon::prelude::*;
use serde::Serialize;
use spts_firmware::SKIN_EDGE_HZ;
use spts_firmware::attiny412::{Device, OSCILLATOR_HZ};

/// Rate for which the skin is designed, edges a second.
pub const DESIGN_EDGE_HZ: f64 = 72_000.0;

/// Edges in which a latency is looked for: hundreds of periods of a timer of 16320 ticks.
const EDGES: usize = 4000;
/// Edges that a clock must not lose to be followed: what is left undone at each edge adds up.
const LONG_RUN: usize = 20_000;
/// Phases of the clock against the cell's own timer from which it is tried.
const PHASES: u64 = 8;
/// Ticks between two phases: an eighth of 16320.
const PHASE_TICKS: u64 = 2040;
/// Edges of the slow clock that show whether the cell puts out the twin's codes: a whole raster.
const SLOW_EDGES: usize = 100;
/// Taxel that is looked at: its turn in the raster is inside the run, not at its ends.
pub(super) const TAXEL: usize = 49;
/// Periods from which the search goes down, ticks: 50 kHz, or the first slower one that works.
const START_TICKS: [u32; 7] = [400, 800, 1600, 3200, 6400, 12_800, 25_600];

/// A clock that every cell follows.
pub(super) const SLOW_HZ: f64 = 5_000.0;

/// How fast one firmware image is in one mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeTiming {
    /// Task of the cell.
    #[serde(flatten)]
    pub task: CellTask,
    /// Longest time from an edge to the new output, CPU cycles at 20 MHz.
    pub latency_cycles: u64,
    /// Shortest time from an edge to the new output, CPU cycles.
    pub latency_cycles_min: u64,
    /// Shortest period of edges from which on none is missed, cycles.
    pub least_period_cycles: u32,
    /// Largest rate of edges up to which none is missed, Hz.
    pub max_edge_hz: f64,
    /// Margin of the period at 72 kHz, relative to the shortest period: `max_edge_hz`/72 kHz − 1.
    pub margin_at_72_khz: f64,
}

impl EmulatedCells {
    /// Latency and largest clock rate for each of [`EmulatedCells::tasks`].
    ///
    /// # Errors
    /// [`FirmwareError`] if a cell does not answer on the bus, puts out codes that differ from the twin's even with a
    /// slow clock, or follows no clock.
    pub fn timing(&self) -> Result<Vec<ModeTiming>, FirmwareError> {
        self.tasks.par_iter().map(|&task| self.task_timing(task)).collect()
    }

    fn task_timing(&self, task: CellTask) -> Result<ModeTiming, FirmwareError> {
        let device = self.cell(task, TAXEL)?;
        if !self.puts_out_the_weights(task, &device)? {
            return Err(self.unusable(CellFailure::OtherCodes { mode: task.name() }));
        }
        let answers = Edges::new(device.clone(), SKIN_EDGE_HZ).take(EDGES);
        // an image may leave out updates that change nothing
        let latencies: Vec<u64> = answers.filter_map(|answer| answer.latency_ticks).collect();
        let (Some(&least), Some(&most)) = (latencies.iter().min(), latencies.iter().max()) else {
            return Err(self.unusable(CellFailure::NoNewCode { mode: task.name() }));
        };
        let least_period_cycles =
            least_period(&device).ok_or_else(|| self.unusable(CellFailure::LosesEdges { mode: task.name() }))?;
        let max_edge_hz = OSCILLATOR_HZ / f64::from(least_period_cycles);
        Ok(ModeTiming {
            task,
            latency_cycles: most,
            latency_cycles_min: least,
            least_period_cycles,
            max_edge_hz,
            margin_at_72_khz: max_edge_hz / DESIGN_EDGE_HZ - 1.0,
        })
    }

    /// Whether the cell puts out the twin's weights under a slow clock.
    fn puts_out_the_weights(&self, task: CellTask, device: &Device) -> Result<bool, FirmwareError> {
        let weights = self.expected_weights(task)?;
        let mut expected = vec![0.0; SLOW_EDGES * weights.taxels()];
        weights.fill_rows(0, &mut expected);
        let expected = expected.chunks_exact(weights.taxels()).map(|row| row[TAXEL]);
        let slow = Edges::new(device.clone(), SLOW_HZ).take(SLOW_EDGES);
        let levels = task.levels();
        Ok(slow
            .zip(expected)
            .all(|(answer, level)| levels.code_level(answer.code).to_bits() == level.to_bits()))
    }
}

/// Shortest period, in ticks, from which on no edge is lost. Which clocks a cell follows depends on how they meet its
/// timer: a period may work by luck below one that does not. So the search goes down from a slow clock, tick by tick,
/// to the first one that fails, and then up to the first one that works in long runs from several phases.
fn least_period(device: &Device) -> Option<u32> {
    let quick = |ticks: u32| follows(device, ticks, EDGES, 0);
    let start = START_TICKS.into_iter().find(|ticks| quick(*ticks))?;
    let mut least = start;
    while least > 1 && quick(least - 1) {
        least -= 1;
    }
    let thorough = |ticks: &u32| {
        let phases = (0..PHASES).into_par_iter();
        phases
            .map(|phase| follows(device, *ticks, LONG_RUN, phase * PHASE_TICKS))
            .all(|kept| kept)
    };
    (least..=start).find(thorough)
}

/// Whether the cell sees every one of `edges` edges that come every `ticks` ticks, the first one `delay_ticks` later
/// than usual.
fn follows(device: &Device, ticks: u32, edges: usize, delay_ticks: u64) -> bool {
    let mut device = device.clone();
    device.run_until(device.now() + delay_ticks);
    let seen_before = device.port_interrupts();
    let mut clocked = Edges::new(device, OSCILLATOR_HZ / f64::from(ticks));
    clocked.by_ref().take(edges).for_each(drop);
    clocked.settled().port_interrupts() - seen_before == edges as u64
}
