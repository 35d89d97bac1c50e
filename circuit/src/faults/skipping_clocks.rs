//! A cell that misses clock edges and then lags behind its sequence.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use crate::weights::Weights;
use rand::seq::index;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Binomial, Distribution as _};
use serde::Deserialize;
use spts_models::{Streams, within};

/// Two edges that arrive before a cell has cleared its interrupt flag collapse into one: the cell is out of step until
/// it is seeded again. One cell of one published session lags by 30, 38 and 43 measurements, about 4e-5 missed edges.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Probability that the cell misses an edge. Range [0, 1]; default 4e-5.
    #[serde(default = "measured")]
    probability: f64,
}

fn measured() -> f64 {
    4e-5
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

pub(super) fn build(table: toml::Table, taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let config: Config = parse(table)?;
    Ok(Box::new(SkippingClocks::new(session, taxel, config.probability)?))
}

impl SkippingClocks {
    /// The cell of `taxel`; it misses an edge with `probability`, range [0, 1].
    ///
    /// # Errors
    /// [`ProfileError`] for a probability out of range.
    pub(crate) fn new(session: &EffectSession, taxel: u32, probability: f64) -> Result<Self, ProfileError> {
        within("probability", probability, 0.0, 1.0, "[0, 1]")?;
        let mut cell = Self {
            weights: session.weights.clone(),
            taxel,
            streams: session.streams.child(LABEL, u64::from(taxel)),
            missed_of_a_stretch: Binomial::new(STRETCH, probability)
                .map_err(|e| ProfileError::Syntax(e.to_string()))?,
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

impl Fault for SkippingClocks {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        self.fill(run.first_row, run.levels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mode::WeightMode;
    use crate::seeding::Seeding;

    fn session() -> EffectSession {
        EffectSession {
            device: Streams::new(9),
            streams: Streams::new(9),
            weights: Weights::new(WeightMode::Binary, Seeding::Address, 8),
            feedback_ohm: 1e3,
            sample_rate_hz: 1e3,
        }
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
