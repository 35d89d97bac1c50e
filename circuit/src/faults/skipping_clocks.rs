//! A cell that misses clock edges and lags behind its own sequence.

use crate::effect::{ProfileError, Session};
use crate::effects::parse;
use crate::fault::{CellRun, Fault};
use crate::weights::Weights;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use spts_models::{Streams, in_range};

/// Two edges that arrive before a cell has cleared its interrupt flag collapse into one: the cell is out of step until it
/// is seeded again. One cell of one published session lags by 30, 38 and 43 measurements, about 4e-5 missed edges.
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

/// The missed edges are drawn one after the other from the first edge on, so that the lag at a row is the same on whatever way
/// the row is reached.
struct SkippingClocks {
    weights: Weights,
    streams: Streams,
    taxel: u32,
    probability: f64,
    rng: ChaCha8Rng,
    /// Edges missed before row `position`.
    lag: u64,
    position: u64,
    /// Row of the next missed edge.
    next_missed: u64,
}

pub(super) fn build(table: toml::Table, taxel: u32, session: &Session) -> Result<Box<dyn Fault>, ProfileError> {
    let config: Config = parse(table)?;
    let sane = (0.0..=1.0).contains(&config.probability);
    in_range("probability", config.probability, sane, "[0, 1]")?;
    let mut fault = SkippingClocks {
        weights: session.weights,
        streams: session.streams,
        taxel,
        probability: config.probability,
        rng: session.streams.rng(LABEL, 0),
        lag: 0,
        position: 0,
        next_missed: 0,
    };
    fault.restart();
    Ok(Box::new(fault))
}

const LABEL: &str = "fault/skipping-clocks";

impl SkippingClocks {
    fn restart(&mut self) {
        self.rng = self.streams.rng(LABEL, u64::from(self.taxel));
        (self.lag, self.position) = (0, 0);
        self.next_missed = self.edges_until_missed();
    }

    /// Edges seen before the next one is missed: geometric.
    fn edges_until_missed(&mut self) -> u64 {
        if self.probability <= 0.0 {
            return u64::MAX;
        }
        let u: f64 = 1.0 - self.rng.random::<f64>();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "float to integer casts saturate"
        )]
        let edges = (u.ln() / (-self.probability).ln_1p()).max(0.0) as u64;
        edges
    }

    /// Edges missed up to and including the one of `row`.
    fn lag_at(&mut self, row: u64) -> u64 {
        while self.next_missed <= row {
            self.lag += 1;
            let edges = self.edges_until_missed();
            self.next_missed = self.next_missed.saturating_add(1).saturating_add(edges);
        }
        self.position = row + 1;
        self.lag
    }
}

impl Fault for SkippingClocks {
    fn seek(&mut self, row: u64) {
        if row < self.position {
            self.restart();
        }
    }

    fn apply(&mut self, run: &mut CellRun<'_>) {
        let first_row = run.first_row;
        for (row, level) in (first_row..).zip(&mut *run.levels) {
            let lag = self.lag_at(row);
            // a cell that has missed every edge so far still holds mid-scale
            *level = row
                .checked_sub(lag)
                .map_or(0.0, |row| self.weights.level(self.taxel, row));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::{Seeding, WeightMode};

    /// Missed edges are as many as the probability says, within five Poisson standard deviations, and the same wherever the
    /// sequence is entered.
    #[test]
    fn the_lag_grows_at_its_rate() {
        let session = Session {
            device: Streams::new(9),
            streams: Streams::new(9),
            weights: Weights::new(WeightMode::Binary, Seeding::Address, 8),
            feedback_ohm: 1e3,
            sample_rate_hz: 1e3,
        };
        let mut fault = SkippingClocks {
            weights: session.weights,
            streams: session.streams,
            taxel: 5,
            probability: 0.01,
            rng: session.streams.rng(LABEL, 0),
            lag: 0,
            position: 0,
            next_missed: 0,
        };
        fault.restart();
        let lags: Vec<u64> = (0..100_000).map(|row| fault.lag_at(row)).collect();
        let missed = *lags.last().unwrap() as f64;
        assert!((missed - 1000.0).abs() < 5.0 * 1000_f64.sqrt(), "{missed} of 1000");
        for row in [70_000, 10, 99_999, 0] {
            fault.seek(row as u64);
            assert_eq!(fault.lag_at(row as u64), lags[row]);
        }
    }
}
