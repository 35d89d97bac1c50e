//! A taxel without connection to the wire.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use serde::Deserialize;

/// The taxel contributes nothing, neither to the weighted sum nor to Σx nor to the contact noise.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Detached {}

pub(super) fn build(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    Ok(Box::new(parse::<Detached>(table)?))
}

impl Fault for Detached {
    fn drives(&self) -> bool {
        false
    }

    fn apply(&mut self, run: &mut CellRun<'_>) {
        run.gains.fill(0.0);
    }
}
