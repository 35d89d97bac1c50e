//! Cells that miss clock edges and then lag behind their sequences, individually or all together.

use crate::batch::{Batch, CellRun};
use crate::effect::{BlockStart, Effect, EffectSession, Span, parsed};
use crate::weights::Weights;
use rand::seq::index;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Binomial, Distribution as _};
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{Snapshot, Streams, within};

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

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let config: Config = parsed(table)?;
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
        let session = EffectSession { streams, ..session.clone() };
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
            for taxel in batch.skin.places() {
                while own.next_if(|cell| cell.taxel() < taxel).is_some() {}
                let cell = own.next_if(|cell| cell.taxel() == taxel);
                if !batch.decided(taxel) {
                    let (weights, common) = (&self.weights, &self.common);
                    let own = u32::try_from(taxel).unwrap_or(u32::MAX);
                    batch.change(taxel, false, |run| fill(weights, own, common, cell, run));
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

    fn exchange(&mut self, state: &mut Snapshot) {
        state.u64(&mut self.block);
        state.u64(&mut self.first_row);
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

const LABEL: &str = "fault/skipping-clocks";
/// Edges of a stretch.
const STRETCH: u64 = 1 << 16;

/// A cell that misses every edge with the same probability, each on its own. So that the lag at a row is the same on
/// whatever way the row is reached, every stretch of edges has a generator, which draws how many are missed (binomial)
/// and which of them (all sets of that many alike).
pub(crate) struct SkippingClocks {
    weights: Weights,
    taxel: u32,
    streams: Streams,
    missed_of_a_stretch: Binomial,
    stretch: u64,
    /// Edges missed before the stretch.
    missed_before: u64,
    /// Missed edges of the stretch in order, counted from its first edge.
    missed: Vec<u64>,
}

impl SkippingClocks {
    /// The cell of `taxel`; it misses an edge with `probability`, range [0, 1].
    ///
    /// # Errors
    /// [`Refusal`] for a probability out of range.
    pub(crate) fn new(session: &EffectSession, taxel: u32, probability: f64) -> Result<Self, Refusal> {
        within("probability", probability, 0.0, 1.0, "[0, 1]")?;
        let mut cell = Self {
            weights: session.weights.clone(),
            taxel,
            streams: session.streams.child(LABEL, u64::from(taxel)),
            missed_of_a_stretch: Binomial::new(STRETCH, probability).map_err(Refusal::from_error)?,
            stretch: 0,
            missed_before: 0,
            missed: Vec::new(),
        };
        cell.draw_stretch();
        Ok(cell)
    }

    /// Taxel of the cell.
    pub(crate) fn taxel(&self) -> usize {
        self.taxel as usize
    }

    /// How many edges of `stretch` are missed, and the generator that says which.
    fn count(&self, stretch: u64) -> (u64, ChaCha8Rng) {
        let mut rng = self.streams.rng("stretch", stretch);
        let missed = self.missed_of_a_stretch.sample(&mut rng);
        (missed.min(STRETCH), rng)
    }

    fn draw_stretch(&mut self) {
        let (missed, mut rng) = self.count(self.stretch);
        #[expect(clippy::cast_possible_truncation, reason = "both are at most STRETCH")]
        let edges = index::sample(&mut rng, STRETCH as usize, missed as usize);
        self.missed.clear();
        self.missed.extend(edges.into_iter().map(|edge| edge as u64));
        self.missed.sort_unstable();
    }

    fn go_to(&mut self, stretch: u64) {
        if stretch == self.stretch {
            return;
        }
        while self.stretch < stretch {
            self.missed_before += self.count(self.stretch).0;
            self.stretch += 1;
        }
        while self.stretch > stretch {
            self.stretch -= 1;
            self.missed_before -= self.count(self.stretch).0;
        }
        self.draw_stretch();
    }

    /// Edges missed up to and including the one of `row`, and the row up to which, exclusively, they are known to be as
    /// many.
    pub(crate) fn lag(&mut self, row: u64) -> (u64, u64) {
        self.go_to(row / STRETCH);
        let edge = row % STRETCH;
        let seen = self.missed.partition_point(|missed| *missed <= edge);
        let next = self.missed.get(seen).copied().unwrap_or(STRETCH);
        (self.missed_before + seen as u64, row - edge + next)
    }

    /// Writes the levels of consecutive rows from `first_row` on; those of a cell that is still in step it leaves
    /// alone.
    pub(crate) fn fill(&mut self, first_row: u64, levels: &mut [f64]) {
        let (mut row, mut left) = (first_row, levels);
        while !left.is_empty() {
            let (lag, until) = self.lag(row);
            let own_row = row.checked_sub(lag);
            // a cell that has missed every edge so far still holds mid-scale
            let rows = if own_row.is_some() { until - row } else { 1 };
            let rows = usize::try_from(rows).map_or(left.len(), |rows| rows.min(left.len()));
            let (these, after) = left.split_at_mut(rows);
            match own_row {
                Some(_) if lag == 0 => {}
                Some(own_row) => self.weights.fill_levels(self.taxel, own_row, these),
                None => these.fill(0.0),
            }
            (row, left) = (row + rows as u64, after);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::{Seeding, WeightMode};

    fn session() -> EffectSession {
        EffectSession::of(9, Weights::new(WeightMode::Binary, Seeding::Address, 8))
    }

    /// Missed edges are as many as the probability says, within five binomial standard deviations, and the same
    /// wherever the sequence is entered.
    #[test]
    fn the_lag_grows_at_its_rate() {
        for probability in [1e-4, 0.01, 0.7] {
            let mut cell = SkippingClocks::new(&session(), 5, probability).unwrap();
            let lags: Vec<u64> = (0..200_000).map(|row| cell.lag(row).0).collect();
            assert!(lags.windows(2).all(|l| l[1] - l[0] <= 1) && lags[0] <= 1);
            let (missed, expected) = (*lags.last().unwrap() as f64, 200_000.0 * probability);
            let tolerance = 5.0 * (expected * (1.0 - probability)).sqrt();
            assert!((missed - expected).abs() < tolerance, "{missed} of {expected}");
            // gaps between missed edges are geometric: their mean square is (2 − p)/p²
            let at: Vec<usize> = (1..lags.len()).filter(|row| lags[*row] > lags[row - 1]).collect();
            if probability > 1e-3 {
                let square: f64 =
                    at.windows(2).map(|w| ((w[1] - w[0]) as f64).powi(2)).sum::<f64>() / (at.len() - 1) as f64;
                let theory = (2.0 - probability) / probability.powi(2);
                // the square of an exponential gap has a relative standard deviation of √5
                let tolerance = 5.0 * 5_f64.sqrt() / (at.len() as f64).sqrt();
                assert!((square / theory - 1.0).abs() < tolerance, "{square} of {theory}");
            }
            for row in [70_000, 10, 199_999, 65_536, 65_535, 0] {
                let (lag, until) = cell.lag(row as u64);
                assert_eq!(lag, lags[row]);
                let rows = usize::try_from(until).unwrap() - row;
                assert!(lags[row..].iter().take(rows).all(|same| *same == lag));
            }
        }
    }

    /// Far into a session, too, a cell that misses every edge has seen none.
    #[test]
    fn a_session_is_not_replayed() {
        let mut cell = SkippingClocks::new(&session(), 5, 1.0).unwrap();
        let row = 1_000_000 * 100;
        let mut levels = [f64::NAN; 300];
        cell.fill(row, &mut levels);
        assert_eq!(cell.lag(row).0, row + 1);
        assert!(levels.iter().all(|level| level.abs() < f64::MIN_POSITIVE));
        assert!(cell.missed.len() as u64 <= STRETCH, "no more than a stretch is kept");
    }
}
