//! Offset of the output and asymmetry of the drive.

use crate::batch::Batch;
use crate::effect::parse;
use crate::effect::{Effect, EffectSession, ProfileError};
use crate::span::Span;
use serde::Deserialize;

/// y += c + a·Σx: a constant, and a share of the sum of all taxels, because the two drive levels are not exactly
/// opposite (the DAC's output does not reach 0 V) and mid-scale is not exactly neutral. In raster mode the share is the
/// background shift of the taxels that are not selected; either part goes without the other.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// c, V, drawn once for each session. Range [−5, 5]; default 0.
    #[serde(default = "none")]
    constant_v: Span,
    /// a, drawn once for each session. Range [−0.5, 0.5]; default 0.
    #[serde(default = "none")]
    asymmetry: Span,
}

fn none() -> Span {
    Span::Fixed(0.0)
}

struct DriveOffset {
    constant_v: f64,
    asymmetry: f64,
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let config: Config = parse(table)?;
    let mut rng = session.streams.rng("drive-offset", 0);
    Ok(Box::new(DriveOffset {
        constant_v: config
            .constant_v
            .within("constant_v", -5.0, 5.0, "[−5, 5]")?
            .draw(&mut rng),
        asymmetry: config
            .asymmetry
            .within("asymmetry", -0.5, 0.5, "[−0.5, 0.5]")?
            .draw(&mut rng),
    }))
}

impl Effect for DriveOffset {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for (y, sum_v) in batch.output_v.iter_mut().zip(&*batch.sum_v) {
            *y += self.constant_v + self.asymmetry * sum_v;
        }
    }
}
