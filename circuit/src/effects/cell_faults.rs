//! Cells that put out something else than they should.

use super::parse;
use crate::batch::Batch;
use crate::effect::{Effect, ProfileError, Session};
use crate::weights::Weights;
use serde::Deserialize;
use spts_models::in_range;

/// Dead and mis-seeded cells. In one published session a cell runs on seed 2: it took the mode byte for its seed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Taxels (0-based, row-major) whose drive stays at mid-scale. Default: none.
    #[serde(default)]
    dead: Vec<u32>,
    /// Cells with another seed than their address. Default: none.
    #[serde(default)]
    mis_seeded: Vec<MisSeeded>,
}

/// A cell with another seed than its address; without effect in raster mode.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct MisSeeded {
    /// 0-based, row-major.
    taxel: u32,
    /// What its generator was loaded with.
    seed: u32,
}

struct CellFaults {
    weights: Weights,
    dead: Vec<usize>,
    mis_seeded: Vec<MisSeeded>,
}

pub(super) fn build(table: toml::Table, session: &Session) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    for taxel in config
        .dead
        .iter()
        .copied()
        .chain(config.mis_seeded.iter().map(|m| m.taxel))
    {
        let known = (taxel as usize) < session.weights.taxels();
        in_range("taxel", f64::from(taxel), known, "[0, taxels)")?;
    }
    Ok(Box::new(CellFaults {
        weights: session.weights,
        dead: config.dead.iter().map(|k| *k as usize).collect(),
        mis_seeded: config.mis_seeded,
    }))
}

impl Effect for CellFaults {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for &k in &self.dead {
            for i in 0..batch.len() {
                batch.output_v[i] -= batch.level(k, i) * batch.taxel_v(k, i);
            }
        }
        if self.weights.mode() == crate::weights::WeightMode::Raster {
            return;
        }
        for m in &self.mis_seeded {
            let k = m.taxel as usize;
            for i in 0..batch.len() {
                let actual = self.weights.level_from_seed(m.seed, batch.row(i));
                batch.output_v[i] += (actual - batch.level(k, i)) * batch.taxel_v(k, i);
            }
        }
    }
}
