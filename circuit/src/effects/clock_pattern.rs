//! Offset that follows the level of the clock line.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{Effect, EffectSession, ProfileError};
use crate::span::Span;
use serde::Deserialize;

/// y ± amplitude: plus after even rows, minus after odd ones. The cells step on both edges of the clock, and the line's
/// level couples into the output.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Half the difference between even and odd rows, V, drawn once for each session. Range [−2, 2].
    amplitude_v: Span,
}

struct ClockPattern {
    amplitude_v: f64,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let amplitude_v = config.amplitude_v.within("amplitude_v", -2.0, 2.0, "[−2, 2]")?;
    Ok(Box::new(ClockPattern {
        amplitude_v: amplitude_v.draw(&mut session.streams.rng("clock-pattern", 0)),
    }))
}

impl Effect for ClockPattern {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for i in 0..batch.len() {
            batch.output_v[i] += if batch.row(i).is_multiple_of(2) {
                self.amplitude_v
            } else {
                -self.amplitude_v
            };
        }
    }
}
