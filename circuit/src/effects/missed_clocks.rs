//! Cells that miss clock edges and lag behind their own sequence.

use super::parse;
use crate::batch::Batch;
use crate::effect::{BlockStart, Effect, ProfileError, Session};
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
    /// Taxels (0-based, row-major) that miss edges.
    taxels: Vec<u32>,
    /// Probability that one of them misses an edge. Range [0, 1]; default 4e-5.
    #[serde(default = "probability")]
    probability: f64,
}

fn probability() -> f64 {
    4e-5
}

struct MissedClocks {
    streams: Streams,
    weights: Weights,
    probability: f64,
    /// Taxel and how many edges it lags.
    lags: Vec<(u32, u64)>,
    rng: ChaCha8Rng,
}

pub(super) fn build(table: toml::Table, session: &Session) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    in_range(
        "probability",
        config.probability,
        (0.0..=1.0).contains(&config.probability),
        "[0, 1]",
    )?;
    for &taxel in &config.taxels {
        let known = (taxel as usize) < session.weights.taxels();
        in_range("taxels", f64::from(taxel), known, "[0, taxels)")?;
    }
    Ok(Box::new(MissedClocks {
        streams: session.streams,
        weights: session.weights,
        probability: config.probability,
        lags: config.taxels.into_iter().map(|k| (k, 0)).collect(),
        rng: session.streams.rng("missed-clocks", 0),
    }))
}

impl Effect for MissedClocks {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng("missed-clocks", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for i in 0..batch.len() {
            let row = batch.row(i);
            for (taxel, lag) in &mut self.lags {
                if *lag <= row && self.rng.random::<f64>() < self.probability {
                    *lag += 1;
                }
                let k = *taxel as usize;
                // a cell that has missed every edge so far still holds mid-scale
                let actual = row.checked_sub(*lag).map_or(0.0, |row| self.weights.level(*taxel, row));
                batch.output_v[i] += (actual - batch.level(k, i)) * batch.taxel_v(k, i);
            }
        }
    }
}
