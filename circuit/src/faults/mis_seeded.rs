//! A cell with a seed other than its address.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use crate::mode::WeightMode;
use serde::Deserialize;

/// The cell's generator was loaded with another number. In one published session a cell runs on seed 2: it took the
/// mode byte for its seed. A raster scan uses no seed and is not disturbed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Seed of the generator. Range [0, 2³² − 1]; default 2.
    #[serde(default = "mode_byte")]
    seed: u32,
}

fn mode_byte() -> u32 {
    2
}

struct MisSeeded {
    mode: WeightMode,
    seed: u32,
}

pub(super) fn build(table: toml::Table, _taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let config: Config = parse(table)?;
    Ok(Box::new(MisSeeded {
        mode: session.weights.mode(),
        seed: config.seed,
    }))
}

impl Fault for MisSeeded {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        if self.mode == WeightMode::Raster {
            return;
        }
        for (row, level, _) in run.iter_mut() {
            *level = self.mode.level_from_seed(self.seed, row);
        }
    }
}
