//! The summing amplifier, modelled from its parts in the time domain.

use crate::amplifier::{Amplifier, AmplifierNoise, BusLoad, Network, OpAmp, Transient};
use crate::batch::Batch;
use crate::effect::{BlockStart, Effect, EffectSession, Span, parsed};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{Snapshot, Streams, in_range};

/// The output as [`Transient`] has it when it is sampled: what is left of the measurements before, slewing, rails,
/// offset and noise come from the parts, with the feedback of the profile.
///
/// A clock edge changes the drives `update_s` later, all at once, and the output is sampled `sample_s` after the edge.
/// The first measurement after a gap is taken as settled. Noise is drawn anew for every measurement, with the rms that
/// the present ΣG gives: its memory, the inverse of the bandwidth, is short beside a period wherever the output settles
/// in one. Of the 1/f noise, a small part of it at such bandwidths, the rms is right, but not that it drifts.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Time from the clock edge to the new drives, s: interrupt, generator and DAC of the cell. Range [0, `sample_s`].
    update_s: f64,
    /// Time from the clock edge to the end of sampling, s. Range [0, 1/sample rate].
    sample_s: f64,
    /// Cb, F; see [`Network`].
    #[serde(default)]
    bus_f: f64,
    /// Cf, F; see [`Network`].
    #[serde(default)]
    feedback_f: f64,
    /// Vos, V, drawn once for each device. Range [−1, 1].
    #[serde(default = "no_offset")]
    offset_v: Span,
    /// Temperature of all resistances, K. Range [1, 1000].
    #[serde(default = "room_k")]
    temperature_k: f64,
    /// The operational amplifier.
    #[serde(default)]
    op_amp: OpAmp,
}

fn no_offset() -> Span {
    Span::Fixed(0.0)
}

fn room_k() -> f64 {
    Network::default().temperature_k
}

struct Summing {
    streams: Streams,
    amplifier: Amplifier,
    /// Time from one sampling to the change of the drives after the next edge, s; and from that change to the next
    /// sampling.
    before_s: f64,
    after_s: f64,
    transient: Transient,
    /// Load since the last change of the drives; `None` after a gap.
    load: Option<BusLoad>,
    rng: ChaCha8Rng,
}

/// Rail of the operational amplifier, V, from the effect's parameters.
pub(super) fn rail_v(table: toml::Table) -> Result<f64, Refusal> {
    Ok(parsed::<Config>(table)?.op_amp.rail_v)
}

pub(super) fn build(table: toml::Table, session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let c: Config = parsed(table)?;
    let period_s = 1.0 / session.sample_rate_hz;
    let sampled = (0.0..=period_s).contains(&c.sample_s);
    in_range("sample_s", c.sample_s, sampled, "[0, 1/sample_rate_hz]")?;
    let updated = (0.0..=c.sample_s).contains(&c.update_s);
    in_range("update_s", c.update_s, updated, "[0, sample_s]")?;
    let rng = &mut session.device.rng("amplifier/offset", 0);
    let network = Network {
        feedback_ohm: session.feedback_ohm,
        feedback_f: c.feedback_f,
        bus_f: c.bus_f,
        offset_v: c.offset_v.drawn("offset_v", [-1.0, 1.0], "[−1, 1]", rng)?,
        temperature_k: c.temperature_k,
    };
    let amplifier = Amplifier::new(c.op_amp, network)?;
    Ok(Box::new(Summing {
        streams: session.streams,
        amplifier,
        before_s: period_s - c.sample_s + c.update_s,
        after_s: c.sample_s - c.update_s,
        transient: Transient::new(amplifier),
        load: None,
        rng: session.streams.rng("amplifier", 0),
    }))
}

/// Nothing on the bus.
const NO_LOAD: BusLoad = BusLoad { conductance_s: 0.0, current_a: 0.0 };

impl Effect for Summing {
    fn begin_block(&mut self, start: &BlockStart) {
        self.rng = self.streams.rng("amplifier", start.block);
        if !start.continuous {
            self.load = None;
        }
    }

    fn apply(&mut self, batch: &mut Batch<'_>) {
        let feedback_ohm = self.amplifier.network().feedback_ohm;
        for (sum_v, output_v) in batch.sum_v.iter().zip(&mut *batch.output_v) {
            let load = BusLoad {
                conductance_s: (sum_v / batch.volts_per_siemens).max(0.0),
                current_a: *output_v / feedback_ohm,
            };
            match self.load.replace(load) {
                None => self.transient.settle(load),
                Some(before) => {
                    self.transient.advance(before, self.before_s);
                    self.transient.advance(load, self.after_s);
                }
            }
            let noise_v = AmplifierNoise::rms(&self.amplifier, load.conductance_s).total();
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            // recordings hold the output with its sign turned
            *output_v = noise_v * normal - self.transient.output_v();
        }
    }

    fn exchange(&mut self, state: &mut Snapshot) {
        self.transient.exchange(state);
        state.rng(&mut self.rng);
        let (mut loaded, mut load) = (self.load.is_some(), self.load.unwrap_or(NO_LOAD));
        state.flag(&mut loaded);
        state.f64s([&mut load.conductance_s, &mut load.current_a]);
        self.load = loaded.then_some(load);
    }
}
