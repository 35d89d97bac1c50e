//! A cell with another seed, whose output is analog and exceeds its swing.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use crate::mode::WeightMode;
use serde::Deserialize;
use spts_models::within;

/// The cell puts out clamp(gain·aₙ + carry·aₙ₋₁ + bias, −1, 1), a being the analog level of a generator that was loaded
/// with `seed`. The defaults are measured on the cell of one published session that took the mode byte for its seed;
/// why it subtracts a share of its level before is not known. A raster scan is not disturbed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Config {
    /// Seed of the generator. Range [0, 2³² − 1].
    seed: u32,
    /// Gain on the present level. Range [−100, 100].
    gain: f64,
    /// Gain on the previous level. Range [−100, 100].
    carry: f64,
    /// Output at level 0. Range [−1, 1].
    bias: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            seed: 2,
            gain: 1.58,
            carry: -0.71,
            bias: 0.08,
        }
    }
}

struct Overdriven {
    mode: WeightMode,
    config: Config,
}

pub(super) fn build(table: toml::Table, _taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let config: Config = parse(table)?;
    for (field, value) in [("gain", config.gain), ("carry", config.carry)] {
        within(field, value, -100.0, 100.0, "[−100, 100]")?;
    }
    within("bias", config.bias, -1.0, 1.0, "[−1, 1]")?;
    Ok(Box::new(Overdriven {
        mode: session.weights.mode(),
        config,
    }))
}

impl Fault for Overdriven {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        if self.mode == WeightMode::Raster {
            return;
        }
        let c = &self.config;
        let analog = |row: u64| WeightMode::Analog.level_from_seed(c.seed, row);
        // before the first edge the cell holds mid-scale
        let mut before = run.first_row.checked_sub(1).map_or(0.0, analog);
        for (row, level, _) in run.iter_mut() {
            let now = analog(row);
            *level = (c.gain * now + c.carry * before + c.bias).clamp(-1.0, 1.0);
            before = now;
        }
    }
}
