//! A cell that drives mid-scale.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use serde::Deserialize;

/// The cell's output stays at mid-scale, level 0, as before its first clock edge.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Dead {}

pub(super) fn build(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    Ok(Box::new(parse::<Dead>(table)?))
}

impl Fault for Dead {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        run.levels.fill(0.0);
    }
}
