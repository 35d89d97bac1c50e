//! A mis-seeded cell whose output is analog and driven beyond its swing.

use super::parse;
use crate::batch::Batch;
use crate::effect::{Effect, ProfileError, Session};
use crate::weights::{WeightMode, Weights};
use serde::Deserialize;
use spts_models::in_range;

/// The cell puts out clamp(gain·aₙ + carry·aₙ₋₁ + bias, −1, 1), a being the analog level of a generator loaded with `seed`, in
/// place of its own ±1; without effect in raster mode.
///
/// Measured in one published session: seed 2, gain 1.58, carry −0.71, bias 0.08. The cell took the mode byte for its seed; why it
/// subtracts a share of its level before is not known.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// 0-based, row-major.
    taxel: u32,
    /// What its generator was loaded with.
    seed: u32,
    /// Gain on the present level. Range [−100, 100].
    gain: f64,
    /// Gain on the level before. Range [−100, 100].
    carry: f64,
    /// Output at level 0. Range [−1, 1].
    bias: f64,
}

struct OverdrivenCell {
    weights: Weights,
    analog: Weights,
    config: Config,
}

pub(super) fn build(table: toml::Table, session: &Session) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let weights = session.weights;
    let known = (config.taxel as usize) < weights.taxels();
    in_range("taxel", f64::from(config.taxel), known, "[0, taxels)")?;
    for (field, value) in [("gain", config.gain), ("carry", config.carry)] {
        in_range(field, value, value.abs() <= 100.0, "[−100, 100]")?;
    }
    in_range("bias", config.bias, config.bias.abs() <= 1.0, "[−1, 1]")?;
    let taxels = u32::try_from(weights.taxels()).unwrap_or(u32::MAX);
    Ok(Box::new(OverdrivenCell {
        analog: Weights::new(WeightMode::Analog, weights.seeding(), taxels),
        weights,
        config,
    }))
}

impl OverdrivenCell {
    fn analog_level(&self, row: u64) -> f64 {
        self.analog.level_from_seed(self.config.seed, row)
    }
}

impl Effect for OverdrivenCell {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        if self.weights.mode() == WeightMode::Raster {
            return;
        }
        let (k, c) = (self.config.taxel as usize, &self.config);
        for i in 0..batch.len() {
            let row = batch.row(i);
            // before the first edge the cell holds mid-scale
            let before = row.checked_sub(1).map_or(0.0, |row| self.analog_level(row));
            let actual = (c.gain * self.analog_level(row) + c.carry * before + c.bias).clamp(-1.0, 1.0);
            batch.output_v[i] += (actual - batch.level(k, i)) * batch.taxel_v(k, i);
        }
    }
}
