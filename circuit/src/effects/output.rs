//! The end of the signal path: the amplifier's rails, the analog-to-digital converter, and the processing of the raster
//! scans before publication.

use crate::batch::Batch;
use crate::converter::Adc;
use crate::effect::{Effect, EffectSession, parsed};
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{in_range, within};

/// The output stays within ± `limit_v`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rails {
    /// Largest output, V. Range (0, 1e6].
    limit_v: f64,
}

/// Largest output, V, from the effect's parameters.
pub(super) fn limit_v(table: toml::Table) -> Result<f64, Refusal> {
    let limit_v = parsed::<Rails>(table)?.limit_v;
    in_range("limit_v", limit_v, limit_v > 0.0 && limit_v <= 1e6, "(0, 1e6]")
}

pub(super) fn rails(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let limit_v = limit_v(table)?;
    Ok(Box::new(Rails { limit_v }))
}

impl Effect for Rails {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = y.clamp(-self.limit_v, self.limit_v);
        }
    }
}

pub(super) fn adc(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    Ok(Box::new(parsed::<Adc>(table)?))
}

impl Effect for Adc {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = self.volts(self.code(*y));
        }
    }
}

/// y ← max(0, y − `subtract_v`): the published press scans have a constant subtracted and are cut off at 0.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Clamp {
    /// Constant that is subtracted before clamping, V. Range [−1e6, 1e6].
    subtract_v: f64,
}

/// Constant that is subtracted, V, from the effect's parameters.
pub(super) fn subtract_v(table: toml::Table) -> Result<f64, Refusal> {
    let subtract_v = parsed::<Clamp>(table)?.subtract_v;
    within("subtract_v", subtract_v, -1e6, 1e6, "[−1e6, 1e6]")?;
    Ok(subtract_v)
}

pub(super) fn clamp(table: toml::Table, _session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let subtract_v = subtract_v(table)?;
    Ok(Box::new(Clamp { subtract_v }))
}

impl Effect for Clamp {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            *y = (*y - self.subtract_v).max(0.0);
        }
    }
}
