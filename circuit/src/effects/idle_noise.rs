//! Noise floor of amplifier and converter.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{BlockStart, Effect, EffectSession, ProfileError};
use crate::span::Span;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_models::Streams;

/// White Gaussian noise that is there with nothing on the skin.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Standard deviation, V, drawn once for each session. Range [0, 10].
    sd_v: Span,
}

struct IdleNoise {
    streams: Streams,
    sd_v: f64,
    rng: ChaCha8Rng,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let sd_v = config.sd_v.within("sd_v", 0.0, 10.0, "[0, 10]")?;
    Ok(Box::new(IdleNoise {
        streams: session.streams,
        sd_v: sd_v.draw(&mut session.streams.rng("idle-noise/session", 0)),
        rng: session.streams.rng("idle-noise", 0),
    }))
}

impl Effect for IdleNoise {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng("idle-noise", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for y in &mut *batch.output_v {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            *y += self.sd_v * normal;
        }
    }
}
