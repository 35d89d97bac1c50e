//! Output range of the summing amplifier.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{Effect, EffectSession, ProfileError};
use serde::Deserialize;
use spts_models::in_range;

/// The output stays within ± `limit_v`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Largest output, V. Range (0, 1e6].
    limit_v: f64,
}

struct Rails {
    limit_v: f64,
}

/// Largest output, V, from the effect's parameters.
pub(super) fn limit_v(table: toml::Table) -> Result<f64, ProfileError> {
    let limit_v = parse::<Config>(table)?.limit_v;
    Ok(in_range(
        "limit_v",
        limit_v,
        limit_v > 0.0 && limit_v <= 1e6,
        "(0, 1e6]",
    )?)
}

pub(super) fn build(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    Ok(Box::new(Rails {
        limit_v: limit_v(table)?,
    }))
}

impl Effect for Rails {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = y.clamp(-self.limit_v, self.limit_v);
        }
    }
}
