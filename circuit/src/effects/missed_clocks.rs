//! Cells that miss clock edges and then lag behind their sequences, individually or all together.

use crate::batch::Batch;
use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{BlockStart, Effect, EffectSession, ProfileError};
use crate::faults::skipping_clocks::SkippingClocks;
use crate::span::Span;
use crate::weights::Weights;
use serde::Deserialize;
use spts_models::within;

/// Every cell misses an edge now and then and is from then on one measurement behind, until it is seeded again: after n
/// edges by n·`probability` on average. The fault `skipping_clocks` is one cell that does so often; a cell with a fault
/// that decides its level is left to that fault.
///
/// Where the clock line itself loses an edge, all cells miss it: whole blocks slip against their rows. Published
/// sessions that slip are 34 measurements behind after three blocks, or 65 after four.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Probability that a cell misses an edge, drawn once for each cell and the same in all sessions. Range [0, 1];
    /// default [0, 1e-8], an estimate: one cell in all published sessions was found to lag.
    #[serde(default = "rarely")]
    probability: Span,
    /// Probability that all cells miss an edge. Range [0, 1]; default 0. Published sessions that slip have about 1e-4.
    #[serde(default)]
    all_probability: f64,
    /// Further positions at which all cells miss edges. Default: none.
    #[serde(default)]
    all_at: Vec<Place>,
}

/// Edges that all cells miss at one place of a session; they lag from then on, in later blocks, too.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    /// Block of the session, from 0.
    block: u64,
    /// First measurement of the block that lags. Default 0.
    #[serde(default)]
    measurement: u64,
    /// Number of missed edges; negative if the cells counted edges that did not exist. Range [−1e6, 1e6].
    edges: i64,
}

fn rarely() -> Span {
    Span::Between([0.0, 1e-8])
}

struct MissedClocks {
    weights: Weights,
    /// Cells that miss edges individually, in order of taxel.
    cells: Vec<SkippingClocks>,
    /// Edges that all cells miss by chance; its taxel has no meaning.
    all: Option<SkippingClocks>,
    places: Vec<Place>,
    block: u64,
    /// Row of the block's first measurement.
    first_row: u64,
    /// Edges that all cells have missed: at the measurement before the batch, then at each measurement of the batch.
    common: Vec<i64>,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let probability = config.probability.within("probability", 0.0, 1.0, "[0, 1]")?;
    within("all_probability", config.all_probability, 0.0, 1.0, "[0, 1]")?;
    for (k, place) in config.all_at.iter().enumerate() {
        let field = format!("all_at[{k}].edges");
        within(&field, place.edges as f64, -1e6, 1e6, "[−1e6, 1e6]")?;
    }
    let mut rng = session.device.rng("missed-clocks", 0);
    let mut cells = Vec::new();
    for taxel in (0..).take(session.weights.taxels()) {
        let probability = probability.draw(&mut rng);
        if probability > 0.0 {
            cells.push(SkippingClocks::new(session, taxel, probability)?);
        }
    }
    let all = (config.all_probability > 0.0).then(|| {
        let streams = session.streams.child("missed-clocks/all", 0);
        let session = EffectSession {
            streams,
            ..session.clone()
        };
        SkippingClocks::new(&session, 0, config.all_probability)
    });
    Ok(Box::new(MissedClocks {
        weights: session.weights.clone(),
        cells,
        all: all.transpose()?,
        places: config.all_at,
        block: 0,
        first_row: 0,
        common: Vec::new(),
    }))
}

impl MissedClocks {
    /// Edges that all cells have missed at `row`.
    fn missed_by_all(&mut self, row: u64) -> i64 {
        let drawn = self.all.as_mut().map_or(0, |all| all.lag(row).0);
        // before the first measurement of a block its own places have not acted
        let measurement = row.checked_sub(self.first_row);
        let acted = |place: &&Place| {
            place.block < self.block || place.block == self.block && measurement.is_some_and(|m| m >= place.measurement)
        };
        let listed: i64 = self.places.iter().filter(acted).map(|place| place.edges).sum();
        i64::try_from(drawn).unwrap_or(i64::MAX).saturating_add(listed)
    }

    /// Writes the edges that all cells have missed at the measurements of `batch` to `common`, and says whether there
    /// are any.
    fn slips(&mut self, batch: &Batch<'_>) -> bool {
        if self.all.is_none() && self.places.is_empty() {
            return false;
        }
        let mut common = std::mem::take(&mut self.common);
        common.clear();
        let before = batch.row(0).saturating_sub(1);
        common.extend((before..batch.row(batch.len())).map(|row| self.missed_by_all(row)));
        self.common = common;
        self.common.iter().any(|missed| *missed != 0)
    }
}

impl Effect for MissedClocks {
    fn begin_block(&mut self, start: &BlockStart) {
        self.block = start.block;
        self.first_row = start.first_row;
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        if self.slips(batch) {
            let mut own = self.cells.iter_mut().peekable();
            for taxel in (0..).take(self.weights.taxels()) {
                let cell = own.next_if(|cell| cell.taxel() == taxel as usize);
                if !batch.decided(taxel as usize) {
                    let (weights, common) = (&self.weights, &self.common);
                    batch.change(taxel as usize, false, |run| fill(weights, taxel, common, cell, run));
                }
            }
            return;
        }
        let (before, after) = (batch.row(0).saturating_sub(1), batch.row(batch.len()));
        for cell in &mut self.cells {
            let (lag, until) = cell.lag(before);
            let in_step = lag == 0 && until >= after;
            if !in_step && !batch.decided(cell.taxel()) {
                batch.change(cell.taxel(), false, |run| cell.fill(run.first_row, run.levels));
            }
        }
    }
}

/// Writes the levels of `taxel` at the rows of `run`: all cells have missed `common` edges there, the cell `own` more.
fn fill(weights: &Weights, taxel: u32, common: &[i64], own: Option<&mut SkippingClocks>, run: &mut CellRun<'_>) {
    let (first_row, count) = (run.first_row, run.levels.len());
    let mut missed = common[common.len() - count..].to_vec();
    if let Some(own) = own {
        for (missed, row) in missed.iter_mut().zip(first_row..) {
            *missed = missed.saturating_add(i64::try_from(own.lag(row).0).unwrap_or(i64::MAX));
        }
    }
    let mut done = 0;
    for same in missed.chunk_by(|a, b| a == b) {
        let levels = &mut run.levels[done..done + same.len()];
        let row = i128::from(first_row) + done as i128 - i128::from(same[0]);
        // a cell that has missed every edge so far still holds mid-scale
        let waiting = usize::try_from(-row).unwrap_or(0).min(levels.len());
        let (without, with) = levels.split_at_mut(waiting);
        without.fill(0.0);
        if let Ok(own_row) = u64::try_from(row.max(0)) {
            weights.fill_levels(taxel, own_row, with);
        }
        done += same.len();
    }
}
