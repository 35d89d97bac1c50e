//! The effects, in signal order.

mod adc;
mod amplifier;
mod clamp;
mod clock_pattern;
mod contact_noise;
mod dac;
mod drive_offset;
mod idle_noise;
mod late_updates;
mod memory;
mod missed_clocks;
mod rails;

pub use adc::Adc;

use crate::converter::Converter;
use crate::effect::{BlockStart, BuildEffect, Effect, ProfileError, Session};
use crate::engine::Engine;
use crate::mode::WeightMode;
use crate::seeding::Seeding;
use crate::source::Interpolated;
use crate::weights::Weights;
use serde::de::DeserializeOwned;
use spts_models::{ConductanceMap, Streams};

/// Every effect by name, in signal order: the cells' digital timing, then the summed analog signal, then the converter, then
/// what the publication did to the numbers. Faults of single cells come before all of them; see [`FAULTS`](crate::FAULTS).
pub const EFFECTS: &[(&str, BuildEffect)] = &[
    ("missed_clocks", missed_clocks::build),
    ("late_updates", late_updates::build),
    ("dac", dac::build),
    ("drive_offset", drive_offset::build),
    ("memory", memory::build),
    ("clock_pattern", clock_pattern::build),
    ("contact_noise", contact_noise::build),
    ("amplifier", amplifier::build),
    ("idle_noise", idle_noise::build),
    ("rails", rails::build),
    ("adc", adc::build),
    ("clamp", clamp::build),
];

/// Effects named in `chain`, each with its table of parameters, in signal order whatever their order in the file.
///
/// # Errors
/// [`ProfileError`] for an unknown effect and for parameters that it refuses.
pub fn build_chain(chain: &toml::Table, session: &Session) -> Result<Vec<Box<dyn Effect>>, ProfileError> {
    if let Some(name) = chain.keys().find(|k| EFFECTS.iter().all(|(name, _)| name != k)) {
        let known: Vec<&str> = EFFECTS.iter().map(|(name, _)| *name).collect();
        return Err(ProfileError::UnknownEffect {
            name: name.clone(),
            known: known.join(", "),
        });
    }
    let mut effects = Vec::new();
    for &(name, build) in EFFECTS {
        effects.extend(of_chain(chain, name, |parameters| build(parameters, session))?);
    }
    Ok(effects)
}

/// What `build` makes of the parameters of effect `name`; `None` when `chain` does not have it.
fn of_chain<T>(
    chain: &toml::Table,
    name: &'static str,
    build: impl FnOnce(toml::Table) -> Result<T, ProfileError>,
) -> Result<Option<T>, ProfileError> {
    let refuse = |reason: String| ProfileError::Effect { effect: name, reason };
    match chain.get(name) {
        None => Ok(None),
        Some(toml::Value::Table(parameters)) => build(parameters.clone()).map(Some).map_err(|e| refuse(e.to_string())),
        Some(_) => Err(refuse("expected a table of parameters".to_owned())),
    }
}

/// Scale that the effects `adc` and `clamp` of `chain` give to what is recorded; `None` without a converter. Nothing acts after them.
///
/// # Errors
/// [`ProfileError`] for parameters that are refused.
pub(crate) fn converter(chain: &toml::Table) -> Result<Option<Converter>, ProfileError> {
    let Some(adc) = of_chain(chain, "adc", parse::<Adc>)? else {
        return Ok(None);
    };
    let subtract_v = of_chain(chain, "clamp", clamp::subtract_v)?;
    Ok(Some(adc.converter(subtract_v)?))
}

/// Checks what every effect promises. `build` makes a fresh one for a session, from parameters that must be valid for 4
/// taxels or more.
///
/// Finite measurements stay finite, from 0 to 1 MV; equal sessions and blocks give equal bits; a block that does not follow on
/// from another one does not depend on it; batches of 1, 7 and 128 measurements give equal bits.
///
/// # Panics
/// When a promise is broken, with the numbers.
pub fn check_effect(build: &dyn Fn(&Session) -> Box<dyn Effect>) {
    for mode in [WeightMode::Binary, WeightMode::Analog, WeightMode::Raster] {
        let session = Session {
            device: Streams::new(2),
            streams: Streams::new(3),
            weights: Weights::new(mode, Seeding::Address, 4),
            feedback_ohm: 1e3,
            sample_rate_hz: 1e3,
        };
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
            for bits in first.iter().chain(&fifth) {
                let volts = f64::from_bits(*bits);
                assert!(volts.is_finite(), "{volts} V, {mode:?}, scale {scale_s} S");
            }
        }
    }
}

/// Bits of 1000 measurements of block `block` through `effect`, while 4 taxels change.
fn block_of(effect: &mut [Box<dyn Effect>; 1], session: &Session, block: u64, scale_s: f64, batch: usize) -> Vec<u64> {
    let map = |a: f64| {
        let values = vec![0.0, scale_s, 0.5 * scale_s, a * scale_s];
        ConductanceMap::from_values(2, 2, values)
    };
    let times_s = vec![0.1, 0.35, 0.8];
    let mut source = Interpolated::new(times_s, vec![map(2.0), map(0.0), map(1.0)]).expect("a valid series");
    let first_row = 1000 * block;
    effect[0].begin_block(&BlockStart {
        block,
        first_row,
        continuous: false,
    });
    let mut volts = vec![0.0; 1000];
    Engine::new(session.weights.clone(), 1e3, 1e3)
        .with_batch(batch)
        .run(effect, first_row, &mut source, &mut volts)
        .expect("the source holds every time");
    volts.iter().map(|v| v.to_bits()).collect()
}

/// Parameters of an effect from its table.
pub(crate) fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, ProfileError> {
    table
        .try_into()
        .map_err(|e| ProfileError::Syntax(e.to_string().trim_end().to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    /// The parameters of `as_built`, or of `as_designed` for what only that has, for the DAC the limits of its data sheet, and for
    /// missed clocks so many that no cell stays in step.
    fn parameters(name: &str) -> toml::Table {
        if name == "dac" {
            return toml::from_str(DATA_SHEET).unwrap();
        }
        if name == "missed_clocks" {
            return toml::from_str("probability = [0.0, 0.3]").unwrap();
        }
        let [built, designed] = ["as_built", "as_designed"].map(|name| Profile::named(name).unwrap());
        let tables = [&built.compressive, &built.raster, &designed.compressive];
        let table = tables.iter().find_map(|effects| effects.get(name)).unwrap();
        table.as_table().unwrap().clone()
    }

    const DATA_SHEET: &str = "reference_v = 4.34\nfloor_v = 0.2\noffset_v = [-0.04, 0.0]\ngain_lsb = [-10.0, 10.0]\n\
                              inl_lsb = [-1.2, 1.2]\ndnl_lsb = 1.0";

    #[test]
    fn every_effect_conforms() {
        for (name, build) in EFFECTS {
            eprintln!("{name}");
            check_effect(&|session| build(parameters(name), session).unwrap());
        }
    }

    #[test]
    fn nonsense_is_refused_with_its_name() {
        let session = Session {
            device: Streams::new(0),
            streams: Streams::new(0),
            weights: Weights::new(WeightMode::Binary, Seeding::Address, 100),
            feedback_ohm: 1e3,
            sample_rate_hz: 67e3,
        };
        let error = |text: &str| {
            build_chain(&toml::from_str(text).unwrap(), &session)
                .map(|_| ())
                .unwrap_err()
                .to_string()
        };
        assert!(error("[hum]").contains("known: missed_clocks, late_updates, "));
        assert!(error("adc = 10").contains("expected a table"));
        assert!(error("[rails]\nlimit = 3.0").contains("limit"));
        for (text, field) in [
            ("[rails]\nlimit_v = nan", "limit_v"),
            ("[rails]\nlimit_v = -1.0", "limit_v"),
            (
                "[dac]\nreference_v = 4.34\nfloor_v = 3.0\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = 0.0\ndnl_lsb = 0.0",
                "`floor_v` = 3 is outside [0, 0.5·reference_v]",
            ),
            (
                "[dac]\nreference_v = 4.34\nfloor_v = 0.2\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = 0.0\ndnl_lsb = 1.5",
                "`dnl_lsb` = 1.5 is outside [0, 1]",
            ),
            ("[memory]\nh1 = 0.1\nh2 = inf", "h2"),
            (
                "[missed_clocks]\nprobability = [0.0, 1.5]",
                "`probability` = 1.5 is outside [0, 1]",
            ),
            ("[memory]\nh1 = [0.2, 0.1]\nh2 = 0.0", "h1"),
            ("[idle_noise]\nsd_v = -0.1", "sd_v"),
            ("[contact_noise]\nfraction = nan", "fraction"),
            ("[drive_offset]\nconstant_v = [0.0, nan]\nasymmetry = 0.0", "constant_v"),
            (
                "[late_updates]\nrate = 0.5\nperiod_measurements = 52.0\nperiod_sd_measurements = 0.2",
                "rate",
            ),
            ("[amplifier]\nupdate_s = 8e-6\nsample_s = 16e-6", "sample_s"),
            ("[amplifier]\nupdate_s = 8e-6\nsample_s = 7e-6", "update_s"),
            (
                "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\nbus_f = -1e-9",
                "`bus_f` = -0.000000001 is outside [0, 1]",
            ),
            (
                "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\nop_amp = { slew_v_per_s = 0.0 }",
                "slew_v_per_s",
            ),
            (
                "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\noffset_v = [1e-3, -1e-3]",
                "offset_v",
            ),
            (
                "[adc]\nbits = 0\nreference_v = 3.3\ndivider = 1.0\noffset_v = 0.0",
                "bits",
            ),
            (
                "[adc]\nbits = 10\nreference_v = 2e3\ndivider = 1.0\noffset_v = 0.0",
                "`reference_v` = 2000 is outside [1e-3, 1e3]",
            ),
            (
                "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 2e3\noffset_v = 0.0",
                "`divider` = 2000 is outside [1e-3, 1e3]",
            ),
            (
                "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 1e-4\noffset_v = 0.0",
                "`divider` = 0.0001 is outside [1e-3, 1e3]",
            ),
            (
                "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 1.0\noffset_v = -2e6",
                "`offset_v` = -2000000 is outside [−1e6, 1e6]",
            ),
            (
                "[adc]\nbits = 10\nreference_v = 1e300\ndivider = 1e300\noffset_v = 0.0",
                "reference_v",
            ),
            ("[rails]\nlimit_v = 2e6", "`limit_v` = 2000000 is outside (0, 1e6]"),
            (
                "[clamp]\nsubtract_v = -2e6",
                "`subtract_v` = -2000000 is outside [−1e6, 1e6]",
            ),
            (
                "[late_updates]\nrate = 0.0\nperiod_measurements = 1.5\nperiod_sd_measurements = 0.0",
                "`period_measurements` = 1.5 is outside [2, 1e9)",
            ),
            (
                "[late_updates]\nrate = 0.0\nperiod_measurements = 50.0\nperiod_sd_measurements = 6.0",
                "`period_sd_measurements` = 6 is outside [0, period_measurements/10]",
            ),
        ] {
            let message = error(text);
            assert!(
                message.contains(field) && message.contains("is outside"),
                "{text}: {message}"
            );
        }
    }
}
