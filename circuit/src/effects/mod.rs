//! The table of effects, in signal order.

mod amplifier;
mod dac;
mod late_updates;
mod missed_clocks;
mod output;
mod signal;

pub(crate) use missed_clocks::SkippingClocks;

use crate::converter::{Adc, Converter};
use crate::effect::{BlockStart, BuildEffect, Effect, EffectSession, parsed};
use crate::engine::Engine;
use crate::source::Interpolated;
use crate::weights::{Mode, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_models::{ConductanceMap, Snapshot, Streams, in_section};

/// Every effect by name, in signal order: the cells' digital timing, the summed analog signal, the converter, and the
/// processing before publication. Faults of single cells act before all effects; see [`FAULTS`](crate::FAULTS).
pub const EFFECTS: &[(&str, BuildEffect)] = &[
    ("missed_clocks", missed_clocks::build),
    ("late_updates", late_updates::build),
    ("dac", dac::build),
    ("drive_offset", signal::drive_offset),
    ("memory", signal::memory),
    ("clock_pattern", signal::clock_pattern),
    ("contact_noise", signal::contact_noise),
    ("amplifier", amplifier::build),
    ("idle_noise", signal::idle_noise),
    ("rails", output::rails),
    ("adc", output::adc),
    ("clamp", output::clamp),
];

/// Builds the effects named in `chain`, each with its table of parameters, in signal order rather than the order of the
/// file.
///
/// ```
/// use spts_circuit::{Mode, Profile};
///
/// let profile = Profile::named("as_built")?;
/// assert!(profile.compressive.contains_key("adc"));
/// let mut without = profile.clone();
/// without.compressive.remove("adc"); // the ablation of the converter
/// assert!(without.converter(Mode::Compressive)?.is_none());
/// # Ok::<(), spts_input::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] for an unknown effect, or parameters that it refuses.
pub fn build_chain(chain: &toml::Table, session: &EffectSession) -> Result<Vec<Box<dyn Effect>>, Refusal> {
    let mode = session.weights.mode().readout();
    if let Some(name) = chain.keys().find(|k| EFFECTS.iter().all(|(name, _)| name != k)) {
        let known: Vec<&str> = EFFECTS.iter().map(|(name, _)| *name).collect();
        return Err(Refusal::new(format!("`{}.{name}` is not an effect; known: {}", mode.name(), known.join(", "))));
    }
    let mut effects = Vec::new();
    for &(name, build) in EFFECTS {
        effects.extend(of_chain(chain, mode, name, |parameters| build(parameters, session))?);
    }
    Ok(effects)
}

/// What `build` makes of the parameters of effect `name`; `None` when `chain` does not have it.
fn of_chain<T>(
    chain: &toml::Table,
    mode: Mode,
    name: &'static str,
    build: impl FnOnce(toml::Table) -> Result<T, Refusal>,
) -> Result<Option<T>, Refusal> {
    let refuse = |reason: &str| Refusal::new(in_section(&format!("{}.{name}", mode.name()), reason));
    match chain.get(name) {
        None => Ok(None),
        Some(toml::Value::Table(parameters)) => build(parameters.clone()).map(Some).map_err(|e| refuse(&e.to_string())),
        Some(_) => Err(refuse("expected a table of parameters")),
    }
}

/// Scale that the effects `adc` and `clamp` of `chain`, those of `mode`, give to what is recorded; `None` without a
/// converter. Nothing acts after them.
///
/// # Errors
/// [`Refusal`] for parameters that are refused.
pub(crate) fn converter(chain: &toml::Table, mode: Mode) -> Result<Option<Converter>, Refusal> {
    let Some(adc) = of_chain(chain, mode, "adc", parsed::<Adc>)? else {
        return Ok(None);
    };
    let subtract_v = of_chain(chain, mode, "clamp", output::subtract_v)?;
    Ok(Some(adc.converter(subtract_v)?))
}

/// Largest output that the effects `amplifier` and `rails` of `chain`, those of `mode`, let through, V; `None` without
/// either.
///
/// # Errors
/// [`Refusal`] for parameters that are refused.
pub(crate) fn rail_v(chain: &toml::Table, mode: Mode) -> Result<Option<f64>, Refusal> {
    let amplifier_v = of_chain(chain, mode, "amplifier", amplifier::rail_v)?;
    let rails_v = of_chain(chain, mode, "rails", output::limit_v)?;
    Ok(amplifier_v.into_iter().chain(rails_v).reduce(f64::min))
}

/// Checks the properties that every effect must have. `build` makes a fresh effect for a session, with parameters that
/// are valid for 4 taxels or more.
///
/// Finite measurements from 0 to 1 MV give finite outputs. Equal sessions and blocks give equal bits. A block that does
/// not follow directly on another does not depend on it. Batches of 1, 7 and 128 measurements give equal bits. A fresh
/// effect that loads the saved state of another goes on with its bits.
///
/// # Panics
/// If the effect lacks a property; the message holds the numbers.
pub fn check_effect(build: &dyn Fn(&EffectSession) -> Box<dyn Effect>) {
    for mode in [WeightMode::Binary, WeightMode::Analog, WeightMode::Raster] {
        let session =
            EffectSession { streams: Streams::new(3), ..EffectSession::of(2, Weights::new(mode, Seeding::Address, 4)) };
        for scale_s in [0.0, 1e-9, 1e-4, 1e3] {
            let mut effect = [build(&session)];
            let first = block_of(&mut effect, &session, 0, scale_s, 128);
            let fifth = block_of(&mut effect, &session, 5, scale_s, 128);
            for batch in [1, 7, 128] {
                let mut effect = [build(&session)];
                let again = block_of(&mut effect, &session, 5, scale_s, batch);
                assert!(
                    fifth == again,
                    "block 5 depends on block 0 or on the batches of {batch}, {mode:?}, scale {scale_s} S"
                );
            }
            let (mut copy, mut saving) = ([build(&session)], Snapshot::saving());
            effect[0].exchange(&mut saving);
            let mut loading = Snapshot::loading(saving.finish().expect("nothing is compared while saving"));
            copy[0].exchange(&mut loading);
            loading.finish().expect("as much is loaded as was saved");
            let [goes_on, same] = [&mut effect, &mut copy].map(|e| rows_of(e, &session, 6000, scale_s, 128));
            assert!(goes_on == same, "a copy by the saved state differs, {mode:?}, scale {scale_s} S");
            for bits in first.iter().chain(&fifth) {
                let volts = f64::from_bits(*bits);
                assert!(volts.is_finite(), "{volts} V, {mode:?}, scale {scale_s} S");
            }
        }
    }
}

/// Bits of 1000 measurements of block `block` through `effect`, while 4 taxels change.
fn block_of(
    effect: &mut [Box<dyn Effect>; 1],
    session: &EffectSession,
    block: u64,
    scale_s: f64,
    batch: usize,
) -> Vec<u64> {
    effect[0].begin_block(&BlockStart { block, first_row: 1000 * block, continuous: false });
    rows_of(effect, session, 1000 * block, scale_s, batch)
}

/// The same of 1000 measurements from row `first_row` on, in the block that was begun.
fn rows_of(
    effect: &mut [Box<dyn Effect>; 1],
    session: &EffectSession,
    first_row: u64,
    scale_s: f64,
    batch: usize,
) -> Vec<u64> {
    let map = |a: f64| {
        let values = vec![0.0, scale_s, 0.5 * scale_s, a * scale_s];
        ConductanceMap::from_values(2, 2, values)
    };
    let times_s = vec![0.1, 0.35, 0.8];
    let mut source = Interpolated::new(times_s, vec![map(2.0), map(0.0), map(1.0)]).expect("a valid series");
    let mut volts = vec![0.0; 1000];
    Engine::new(session.weights.clone(), 1e3, 1e3)
        .with_batch(batch)
        .run(effect, first_row, &mut source, &mut volts)
        .expect("the source holds every time");
    volts.iter().map(|v| v.to_bits()).collect()
}
