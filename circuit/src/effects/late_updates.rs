//! Taxels that still have their previous level when the output is sampled.

use crate::batch::Batch;
use crate::effect::{BlockStart, Effect, EffectSession, Span, parsed};
use crate::weights::WeightMode;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{Snapshot, Streams, in_range, within};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Each cell's millisecond timer beats against the common clock: every `period_measurements` its interrupt collides
/// with an edge and may delay the update past the moment of sampling. The output then errs by (previous − new
/// level)·xᵢ.
///
/// Measured from the published recordings: beat every 52.44 ± 0.20 measurements (six cells), 0.18 % of all weight flips
/// late on average, at most 0.5 % on one taxel.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Share of a taxel's flips that come late, drawn once for each taxel and session. Range [0,
    /// 0.5/`period_measurements`].
    rate: Span,
    /// Mean beat period between the cell's timer and the clock, measurements. Range [2, 1e9).
    period_measurements: f64,
    /// Standard deviation of that period over the cells, whose oscillators differ. A cell keeps its period in all
    /// sessions. Range [0, `period_measurements`/10].
    period_sd_measurements: f64,
}

struct Cell {
    phase: f64,
    period: f64,
    /// Probability that a collision of timer and clock makes the cell late.
    late: f64,
    /// ln(1 − late).
    ln_in_time: f64,
    /// Number of the next collision at which the cell is late.
    collision: f64,
}

impl Cell {
    /// The cell with the oscillator and the probability that are drawn by these generators.
    fn drawn(config: &Config, oscillators: &mut ChaCha8Rng, cells: &mut ChaCha8Rng) -> Self {
        let normal: f64 = StandardNormal.sample(oscillators);
        let period = config.period_measurements + config.period_sd_measurements * normal.clamp(-4.0, 4.0);
        let phase = period * cells.random::<f64>();
        Self { phase, period, late: 0.0, ln_in_time: 0.0, collision: 0.0 }.late_at(config.rate.draw(cells) * period)
    }

    /// The same with this probability that a collision makes it late.
    fn late_at(self, late: f64) -> Self {
        Self { late, ln_in_time: (-late).ln_1p(), ..self }
    }

    /// First collision that acts on `first_row` or a later row: φ + n·period > `first_row` − 1.
    fn first_collision(&self, first_row: u64) -> f64 {
        let mut collision = ((first_row as f64 - 1.0 - self.phase) / self.period).floor().max(0.0);
        // by the rows themselves, so that no rounding leaves one out or has it in two blocks
        while row_of(self.phase + collision * self.period) < first_row {
            collision += 1.0;
        }
        collision
    }

    /// Whether a collision acts on `row`.
    fn collides(&self, row: u64) -> bool {
        row_of(self.phase + self.first_collision(row) * self.period) == row
    }

    /// Moves to the first late collision at or after `self.collision` and returns its row.
    fn advance(&mut self, rng: &mut ChaCha8Rng) -> u64 {
        if self.late <= 0.0 {
            return u64::MAX;
        }
        // number of harmless collisions before the late one is geometric
        let u: f64 = 1.0 - rng.random::<f64>();
        self.collision += whole(u.ln() / self.ln_in_time) as f64;
        row_of(self.phase + self.collision * self.period)
    }
}

/// The whole part of a number that is not negative. A cast, where the library's `floor` is a call on the baseline
/// instruction set.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "float to integer casts saturate; a session never reaches 2^53 measurements"
)]
fn whole(value: f64) -> u64 {
    value as u64
}

/// First row that is not before `time`.
fn row_of(time: f64) -> u64 {
    let row = whole(time);
    row.saturating_add(u64::from((row as f64) < time))
}

struct LateUpdates {
    streams: Streams,
    cells: Vec<Cell>,
    rng: ChaCha8Rng,
    /// Row of the next late update of every cell, the earliest first, and of equal ones the cell of the lowest number.
    queue: BinaryHeap<Reverse<(u64, usize)>>,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let config: Config = parsed(table)?;
    let period = config.period_measurements;
    in_range("period_measurements", period, (2.0..1e9).contains(&period), "[2, 1e9)")?;
    let sd = config.period_sd_measurements;
    within("period_sd_measurements", sd, 0.0, 0.1 * period, "[0, period_measurements/10]")?;
    config.rate.within("rate", 0.0, 0.5 / period, "[0, 0.5/period_measurements]")?;
    if session.cells_apart {
        let (device, session) = (session.device, session.streams);
        return Ok(Box::new(LateCells { config, device, session, block: session, cells: HashMap::new() }));
    }
    let mut oscillators = session.device.rng("late-updates/oscillators", 0);
    let mut rng = session.streams.rng("late-updates/cells", 0);
    let cells = session.weights.taxels();
    let cells = (0..cells).map(|_| Cell::drawn(&config, &mut oscillators, &mut rng)).collect();
    if session.weights.mode() == WeightMode::Raster {
        return Ok(Box::new(LateRaster::new(session.streams, cells)));
    }
    Ok(Box::new(LateUpdates { streams: session.streams, cells, rng, queue: BinaryHeap::new() }))
}

impl Effect for LateUpdates {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng("late-updates", start.block);
        self.queue.clear();
        for (k, cell) in self.cells.iter_mut().enumerate() {
            cell.collision = cell.first_collision(start.first_row);
            self.queue.push(Reverse((cell.advance(&mut self.rng), k)));
        }
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for (i, row) in (batch.row(0)..batch.row(batch.len())).enumerate() {
            while let Some(mut next) = self.queue.peek_mut().filter(|next| next.0.0 <= row) {
                let k = next.0.1;
                let held = batch.previous_level(k, i) - batch.level(k, i);
                batch.output_v[i] += held * batch.taxel_v(k, i);
                let cell = &mut self.cells[k];
                cell.collision += 1.0;
                *next = Reverse((cell.advance(&mut self.rng), k));
            }
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.rng(&mut self.rng);
        // a queue that was not begun is empty
        let mut rows = vec![u64::MAX; self.cells.len()];
        for Reverse((row, k)) in &self.queue {
            rows[*k] = *row;
        }
        let mut begun = !self.queue.is_empty();
        state.flag(&mut begun);
        for (cell, row) in self.cells.iter_mut().zip(&mut rows) {
            state.f64(&mut cell.collision);
            state.u64(row);
        }
        let next = rows.into_iter().enumerate().map(|(k, row)| Reverse((row, k)));
        self.queue = if begun { next.collect() } else { BinaryHeap::new() };
    }
}

/// The same process as that of any weights. A cell that puts out again what it held cannot be late, so that only those
/// that change are looked at: whether their timer collides with this edge, and whether that makes them late.
struct LateRaster {
    session: Streams,
    /// Streams of the block.
    block: Streams,
    cells: Vec<Cell>,
    /// Scratch: the cells that may change in a row.
    changing: Vec<usize>,
}

impl LateRaster {
    fn new(session: Streams, cells: Vec<Cell>) -> Self {
        Self { session, block: session, cells, changing: Vec::new() }
    }
}

impl Effect for LateRaster {
    fn begin_block(&mut self, start: &BlockStart) {
        self.block = self.session.child("late-updates", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        let count = self.cells.len() as u64;
        for (i, row) in (batch.row(0)..batch.row(batch.len())).enumerate() {
            let scanned = [row % count, (row + count - 1) % count];
            self.changing.clear();
            if batch.rows.are_given() {
                // whatever put them out, any cell may change
                self.changing.extend(0..self.cells.len());
            } else {
                let scanned = scanned.iter().filter_map(|k| usize::try_from(*k).ok());
                self.changing.extend(scanned);
                // cells that missed clocks or have faults change at other times
                self.changing.extend(batch.cells.iter().map(|cell| cell.taxel));
                self.changing.sort_unstable();
                self.changing.dedup();
            }
            for &k in &self.changing {
                let held = batch.previous_level(k, i) - batch.level(k, i);
                let cell = &self.cells[k];
                if held.abs() > 0.0 && cell.late > 0.0 && cell.collides(row) {
                    let draw: f64 = self.block.child("row", row).rng("cell", k as u64).random();
                    if draw < cell.late {
                        batch.output_v[i] += held * batch.taxel_v(k, i);
                    }
                }
            }
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.streams(&mut self.block);
    }
}

/// The same process where few taxels conduct: a cell is drawn from streams of its own, and only those that conduct are
/// looked at.
struct LateCells {
    config: Config,
    device: Streams,
    session: Streams,
    block: Streams,
    /// Cells that have conducted.
    cells: HashMap<usize, Cell>,
}

impl Effect for LateCells {
    fn begin_block(&mut self, start: &BlockStart) {
        self.block = self.session.child("late-updates", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        let (first, end) = (batch.row(0), batch.row(batch.len()));
        for k in batch.skin.places() {
            let cell = self.cells.entry(k).or_insert_with(|| {
                let rng = |streams: &Streams, label| streams.rng(label, k as u64);
                let oscillator = &mut rng(&self.device, "late-updates/oscillator");
                Cell::drawn(&self.config, oscillator, &mut rng(&self.session, "late-updates/cell"))
            });
            let mut collision = cell.first_collision(first);
            loop {
                let row = row_of(cell.phase + collision * cell.period);
                if row >= end {
                    break;
                }
                collision += 1.0;
                if self.block.uniform([row, k as u64]) < cell.late {
                    #[expect(clippy::cast_possible_truncation, reason = "less than the batch is long")]
                    let i = (row - first) as usize;
                    let held = batch.previous_level(k, i) - batch.level(k, i);
                    batch.output_v[i] += held * batch.taxel_v(k, i);
                }
            }
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.streams(&mut self.block);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Engine;
    use crate::source::Constant;
    use crate::weights::{Seeding, Weights};
    use spts_models::ConductanceMap;

    /// Cells of which every collision makes a late one.
    fn always_late() -> Vec<Cell> {
        let cell = |k: u32| Cell {
            phase: 0.3 * f64::from(k),
            period: [2.0, 2.5, 3.01, 52.44][k as usize],
            late: 0.0,
            ln_in_time: 0.0,
            collision: 0.0,
        };
        (0..4).map(|k| cell(k).late_at(1.0)).collect()
    }

    fn any_weights() -> LateUpdates {
        LateUpdates {
            streams: Streams::new(0),
            cells: always_late(),
            rng: Streams::new(0).rng("late-updates", 0),
            queue: BinaryHeap::new(),
        }
    }

    /// The 10,000 rows of four cells, in blocks of `rows`.
    fn run(weights: &Weights, late: Box<dyn Effect>, rows: usize) -> Vec<f64> {
        let mut effects = [late];
        let map = ConductanceMap::from_values(2, 2, vec![1e-3, 2e-3, 4e-3, 8e-3]);
        let mut skin = Constant::new(map).unwrap();
        let mut volts = vec![0.0; 10_000];
        for (block, volts) in (0..).zip(volts.chunks_mut(rows)) {
            let first_row = block * rows as u64;
            effects[0].begin_block(&BlockStart { block, first_row, continuous: true });
            let mut engine = Engine::new(weights.clone(), 1e3, 1e3);
            engine.run(&mut effects, first_row, &mut skin, volts).unwrap();
        }
        volts
    }

    /// Where every collision makes its cell late, nothing is random: a block and the same rows in blocks of 100 have
    /// the same late rows, whatever the collisions' place between two rows.
    #[test]
    fn collisions_between_blocks_are_not_lost() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 4);
        let (whole, mut nominal) = (run(&weights, Box::new(any_weights()), 10_000), vec![0.0; 10_000]);
        weights.weighted_sums(0, &[1.0, 2.0, 4.0, 8.0], &mut nominal);
        let late = whole.iter().zip(&nominal).filter(|(y, u)| (**y - **u).abs() > 0.5).count();
        assert!(late > 3000, "{late} late rows");
        assert!(whole == run(&weights, Box::new(any_weights()), 100));
    }

    /// Cells that are drawn apart are as late as those that are drawn together; with certain ones, at the same rows.
    #[test]
    fn cells_apart_are_late_alike() {
        let parameters = "rate = 0.009\nperiod_measurements = 52.3\nperiod_sd_measurements = 0.2";
        for mode in [WeightMode::Binary, WeightMode::Analog, WeightMode::Raster] {
            let weights = Weights::new(mode, Seeding::Mixed, 4);
            let late = |cells_apart| {
                let session = EffectSession { cells_apart, ..EffectSession::of(5, weights.clone()) };
                build(toml::from_str(parameters).unwrap(), &session).unwrap()
            };
            let mut nominal = vec![0.0; 10_000];
            weights.weighted_sums(0, &[1.0, 2.0, 4.0, 8.0], &mut nominal);
            let errors = |volts: &[f64]| volts.iter().zip(&nominal).filter(|(y, u)| (**y - **u).abs() > 1e-9).count();
            let [apart, together] = [true, false].map(|apart| errors(&run(&weights, late(apart), 10_000)) as f64);
            // Poisson counts
            assert!((apart - together).abs() < 4.0 * (apart + together).sqrt(), "{mode:?}: {apart}, {together}");
            assert!(apart > 10.0, "{mode:?}: {apart}");
            let certain = || {
                let session = EffectSession::of(5, weights.clone());
                let config = toml::from_str(parameters).unwrap();
                let cells = always_late().into_iter().enumerate().collect();
                let (device, session) = (session.device, session.streams);
                Box::new(LateCells { config, device, session, block: session, cells })
            };
            let all = run(&weights, Box::new(any_weights()), 10_000);
            assert!(all == run(&weights, certain(), 10_000) && all == run(&weights, certain(), 100), "{mode:?}");
        }
    }

    /// A raster scan has the same late rows whether all collisions are gone through, or the cells that change alone.
    #[test]
    fn a_raster_scan_needs_the_cells_that_change() {
        let weights = Weights::new(WeightMode::Raster, Seeding::Mixed, 4);
        let raster = || Box::new(LateRaster::new(Streams::new(0), always_late()));
        let all = run(&weights, Box::new(any_weights()), 10_000);
        assert!(all == run(&weights, raster(), 10_000) && all == run(&weights, raster(), 100));
        let late = all.iter().zip([1.0, 2.0, 4.0, 8.0].iter().cycle());
        let late = late.filter(|(y, u)| (**y - **u).abs() > 0.5).count();
        assert!(late > 3000, "{late} late rows");
    }
}
