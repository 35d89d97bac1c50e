//! Remainder of earlier measurements in the present one.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{BlockStart, Effect, EffectSession, ProfileError};
use crate::span::Span;
use serde::Deserialize;

/// yₙ += h1·uₙ₋₁ + h2·uₙ₋₂, u being the undisturbed output. Not one settling pole: in the published recordings the
/// second tap is the steadier one. In raster mode h1 is the undershoot of the taxel scanned next.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// First tap, drawn once for each session. Range [−0.4, 0.4].
    h1: Span,
    /// Second tap, drawn once for each session. Range [−0.4, 0.4].
    h2: Span,
}

struct Memory {
    h1: f64,
    h2: f64,
    /// Outputs before this effect at the last two measurements, V.
    past_v: [f64; 2],
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let mut rng = session.streams.rng("memory", 0);
    Ok(Box::new(Memory {
        h1: config.h1.within("h1", -0.4, 0.4, "[−0.4, 0.4]")?.draw(&mut rng),
        h2: config.h2.within("h2", -0.4, 0.4, "[−0.4, 0.4]")?.draw(&mut rng),
        past_v: [0.0; 2],
    }))
}

impl Effect for Memory {
    fn begin_block(&mut self, start: &BlockStart) {
        if !start.continuous {
            self.past_v = [0.0; 2];
        }
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            let now_v = *y;
            *y += self.h1 * self.past_v[0] + self.h2 * self.past_v[1];
            self.past_v = [now_v, self.past_v[0]];
        }
    }
}
