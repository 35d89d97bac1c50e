//! A cell that holds one level.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use serde::Deserialize;
use spts_models::within;

/// The cell's output never changes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stuck {
    /// The level: −1 is code 0, 1 is code 255. Range [−1, 1]; default 1.
    #[serde(default = "high")]
    level: f64,
}

fn high() -> f64 {
    1.0
}

pub(super) fn build(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let stuck: Stuck = parse(table)?;
    within("level", stuck.level, -1.0, 1.0, "[−1, 1]")?;
    Ok(Box::new(stuck))
}

impl Fault for Stuck {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        run.levels.fill(self.level);
    }
}
