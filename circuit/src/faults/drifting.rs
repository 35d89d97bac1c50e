//! A taxel whose gain changes with time.

use crate::cell_run::CellRun;
use crate::effect::parse;
use crate::effect::{EffectSession, ProfileError};
use crate::fault::Fault;
use serde::Deserialize;
use spts_models::within;

/// The taxel's contribution is multiplied by max(0, 1 + rate·t), t seconds after the seeds were loaded.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Drifting {
    /// Relative change a second, 1/s. Range [−10, 10]; default −0.01.
    #[serde(default = "slow_loss")]
    rate_per_s: f64,
}

fn slow_loss() -> f64 {
    -0.01
}

pub(super) fn build(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let drifting: Drifting = parse(table)?;
    let rate = drifting.rate_per_s;
    within("rate_per_s", rate, -10.0, 10.0, "[−10, 10]")?;
    Ok(Box::new(drifting))
}

impl Fault for Drifting {
    fn drives(&self) -> bool {
        false
    }

    fn apply(&mut self, run: &mut CellRun<'_>) {
        let period_s = run.period_s;
        for (row, _, gain) in run.iter_mut() {
            *gain *= (1.0 + self.rate_per_s * (row as f64 * period_s)).max(0.0);
        }
    }
}
