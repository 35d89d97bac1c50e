//! Processing of the raster scans before publication.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{Effect, EffectSession, ProfileError};
use serde::Deserialize;
use spts_models::within;

/// y ← max(0, y − `subtract_v`): the published press scans have a constant subtracted and are cut off at 0.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Constant that is subtracted before clamping, V. Range [−1e6, 1e6].
    subtract_v: f64,
}

struct Clamp {
    subtract_v: f64,
}

/// Constant that is subtracted, V, from the effect's parameters.
pub(super) fn subtract_v(table: toml::Table) -> Result<f64, ProfileError> {
    let config: Config = parse(table)?;
    within("subtract_v", config.subtract_v, -1e6, 1e6, "[−1e6, 1e6]")?;
    Ok(config.subtract_v)
}

pub(super) fn build(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    Ok(Box::new(Clamp {
        subtract_v: subtract_v(table)?,
    }))
}

impl Effect for Clamp {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = (*y - self.subtract_v).max(0.0);
        }
    }
}
