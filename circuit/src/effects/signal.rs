//! What is added to the summed signal: offsets, a remainder of earlier measurements, and noise.

use crate::batch::Batch;
use crate::effect::{BlockStart, Effect, EffectSession, Span, parsed};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{Snapshot, Streams};

/// y += c + a·Σx: a constant, and a share of the sum of all taxels, because the two drive levels are not exactly
/// opposite (the DAC's output does not reach 0 V) and mid-scale is not exactly neutral. In raster mode the share is the
/// background shift of the taxels that are not selected; either part goes without the other.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveOffsetConfig {
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

pub(super) fn drive_offset(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let c: DriveOffsetConfig = parsed(table)?;
    let rng = &mut session.streams.rng("drive-offset", 0);
    Ok(Box::new(DriveOffset {
        constant_v: c.constant_v.drawn("constant_v", [-5.0, 5.0], "[−5, 5]", rng)?,
        asymmetry: c.asymmetry.drawn("asymmetry", [-0.5, 0.5], "[−0.5, 0.5]", rng)?,
    }))
}

impl Effect for DriveOffset {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for (y, sum_v) in batch.output_v.iter_mut().zip(&*batch.sum_v) {
            *y += self.constant_v + self.asymmetry * sum_v;
        }
    }
}

/// yₙ += h1·uₙ₋₁ + h2·uₙ₋₂, u being the undisturbed output. Not one settling pole: in the published recordings the
/// second tap is the steadier one. In raster mode h1 is the undershoot of the taxel scanned next.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MemoryConfig {
    /// First tap, drawn once for each session. Range [−0.4, 0.4].
    h1: Span,
    /// Second tap, drawn once for each session. Range [−0.4, 0.4].
    h2: Span,
}

struct Memory {
    taps: [f64; 2],
    /// Outputs before this effect at the last two measurements, V.
    past_v: [f64; 2],
}

pub(super) fn memory(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let c: MemoryConfig = parsed(table)?;
    let rng = &mut session.streams.rng("memory", 0);
    let mut tap = |field, span: Span| span.drawn(field, [-0.4, 0.4], "[−0.4, 0.4]", rng);
    Ok(Box::new(Memory { taps: [tap("h1", c.h1)?, tap("h2", c.h2)?], past_v: [0.0; 2] }))
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
            *y += self.taps[0] * self.past_v[0] + self.taps[1] * self.past_v[1];
            self.past_v = [now_v, self.past_v[0]];
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.f64s(&mut self.past_v);
    }
}

/// y ± amplitude: plus after even rows, minus after odd ones. The cells step on both edges of the clock, and the line's
/// level couples into the output.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ClockPatternConfig {
    /// Half the difference between even and odd rows, V, drawn once for each session. Range [−2, 2].
    amplitude_v: Span,
}

struct ClockPattern {
    amplitude_v: f64,
}

pub(super) fn clock_pattern(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let rng = &mut session.streams.rng("clock-pattern", 0);
    let span = parsed::<ClockPatternConfig>(table)?.amplitude_v;
    let amplitude_v = span.drawn("amplitude_v", [-2.0, 2.0], "[−2, 2]", rng)?;
    Ok(Box::new(ClockPattern { amplitude_v }))
}

impl Effect for ClockPattern {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for i in 0..batch.len() {
            let even = batch.row(i).is_multiple_of(2);
            batch.output_v[i] += if even { self.amplitude_v } else { -self.amplitude_v };
        }
    }
}

/// Noise of pressed taxels: white and Gaussian, with the standard deviation `fraction`·√Σ(wᵢ·xᵢ)². Every driven taxel's
/// contribution has an independent relative error. With weights ±1 that is a share of ‖x‖₂. It dominates: thermal and
/// amplifier noise are a thousand times smaller.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactNoiseConfig {
    /// Relative error of a contribution, drawn once for each session. Range [0, 1].
    fraction: Span,
}

/// Noise floor of amplifier and converter: white Gaussian noise that is there with nothing on the skin.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct IdleNoiseConfig {
    /// Standard deviation, V, drawn once for each session. Range [0, 10].
    sd_v: Span,
}

/// White Gaussian noise.
struct Noise {
    streams: Streams,
    label: &'static str,
    sd: f64,
    /// Whether `sd` is relative to √Σ(wᵢ·xᵢ)², and not in V.
    relative: bool,
    rng: ChaCha8Rng,
}

pub(super) fn contact_noise(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let rng = &mut session.streams.rng("contact-noise/session", 0);
    let span = parsed::<ContactNoiseConfig>(table)?.fraction;
    let fraction = span.drawn("fraction", [0.0, 1.0], "[0, 1]", rng)?;
    Ok(Box::new(Noise::new(session, "contact-noise", fraction, true)))
}

pub(super) fn idle_noise(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let rng = &mut session.streams.rng("idle-noise/session", 0);
    let sd_v = parsed::<IdleNoiseConfig>(table)?.sd_v.drawn("sd_v", [0.0, 10.0], "[0, 10]", rng)?;
    Ok(Box::new(Noise::new(session, "idle-noise", sd_v, false)))
}

impl Noise {
    fn new(session: &EffectSession, label: &'static str, sd: f64, relative: bool) -> Self {
        let streams = session.streams;
        let rng = streams.rng(label, 0);
        Self { streams, label, sd, relative, rng }
    }
}

impl Effect for Noise {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng(self.label, start.block);
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        for (y, norm_v) in batch.output_v.iter_mut().zip(&*batch.norm_v) {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            let sd_v = if self.relative { self.sd * norm_v } else { self.sd };
            *y += sd_v * normal;
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        state.rng(&mut self.rng);
    }
}
