//! Noise of pressed taxels.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{BlockStart, Effect, EffectSession, ProfileError};
use crate::span::Span;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_models::Streams;

/// White Gaussian noise of standard deviation `fraction`·√Σ(wᵢ·xᵢ)²: every driven taxel's contribution has an
/// independent relative error. With weights ±1 that is a share of ‖x‖₂. It dominates: thermal and amplifier noise are a
/// thousand times smaller.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Relative error of a contribution, drawn once for each session. Range [0, 1].
    fraction: Span,
}

struct ContactNoise {
    streams: Streams,
    fraction: f64,
    rng: ChaCha8Rng,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let fraction = config.fraction.within("fraction", 0.0, 1.0, "[0, 1]")?;
    Ok(Box::new(ContactNoise {
        streams: session.streams,
        fraction: fraction.draw(&mut session.streams.rng("contact-noise/session", 0)),
        rng: session.streams.rng("contact-noise", 0),
    }))
}

impl Effect for ContactNoise {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng("contact-noise", start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for (y, norm_v) in batch.output_v.iter_mut().zip(&*batch.norm_v) {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            *y += self.fraction * norm_v * normal;
        }
    }
}
