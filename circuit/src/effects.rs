//! The effects, in signal order.

mod adc;
mod cell_faults;
mod clamp;
mod clock_pattern;
mod contact_noise;
mod drive_offset;
mod idle_noise;
mod late_updates;
mod memory;
mod missed_clocks;
mod rails;

pub use adc::Adc;

use crate::effect::{BlockStart, BuildEffect, Effect, ProfileError, Sample, Session};
use crate::weights::{Seeding, WeightMode, Weights};
use serde::de::DeserializeOwned;
use spts_models::Streams;

/// Every effect by name, in signal order: digital faults of the cells, then the summed analog signal, then the converter,
/// then what the publication did to the numbers.
pub const EFFECTS: &[(&str, BuildEffect)] = &[
    ("cell_faults", cell_faults::build),
    ("missed_clocks", missed_clocks::build),
    ("late_updates", late_updates::build),
    ("drive_offset", drive_offset::build),
    ("memory", memory::build),
    ("clock_pattern", clock_pattern::build),
    ("contact_noise", contact_noise::build),
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
        let Some(parameters) = chain.get(name) else { continue };
        let refuse = |reason: String| ProfileError::Effect { effect: name, reason };
        let toml::Value::Table(parameters) = parameters else {
            return Err(refuse("expected a table of parameters".to_owned()));
        };
        effects.push(build(parameters.clone(), session).map_err(|e| refuse(e.to_string()))?);
    }
    Ok(effects)
}

/// Checks what every effect promises. `build` makes a fresh one for a session, from parameters that must be valid for 4
/// taxels or more.
///
/// Finite samples stay finite, from 0 to 1 MV; equal sessions and blocks give equal bits; a block that does not follow on from
/// another one does not depend on it.
///
/// # Panics
/// When a promise is broken, with the numbers.
pub fn check_effect(build: &dyn Fn(&Session) -> Box<dyn Effect>) {
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, 4);
    let session = Session {
        streams: Streams::new(3),
        weights,
    };
    let run = |effect: &mut dyn Effect, block: u64, scale_s: f64| {
        let first_row = 1000 * block;
        effect.begin_block(&BlockStart {
            block,
            first_row,
            continuous: false,
        });
        let (mut levels, mut previous_levels) = ([0.0; 4], [0.0; 4]);
        let conductance_s = [0.0, scale_s, 0.5 * scale_s, 2.0 * scale_s];
        let mut outputs = Vec::new();
        for row in first_row..first_row + 1000 {
            std::mem::swap(&mut levels, &mut previous_levels);
            weights.fill_row(row, &mut levels);
            let terms = levels.iter().zip(&conductance_s).map(|(w, g)| w * g);
            let mut sample = Sample {
                row,
                levels: &levels,
                previous_levels: &previous_levels,
                conductance_s: &conductance_s,
                volts_per_siemens: 1e3,
                sum_v: 1e3 * conductance_s.iter().sum::<f64>(),
                norm_v: 1e3 * terms.clone().map(|x| x * x).sum::<f64>().sqrt(),
                output_v: 1e3 * terms.sum::<f64>(),
            };
            effect.apply(&mut sample);
            assert!(
                sample.output_v.is_finite(),
                "{} V at row {row}, scale {scale_s} S",
                sample.output_v
            );
            outputs.push(sample.output_v.to_bits());
        }
        outputs
    };
    for scale_s in [0.0, 1e-9, 1e-4, 1e3] {
        let (mut once, mut again) = (build(&session), build(&session));
        run(once.as_mut(), 0, scale_s);
        assert!(
            run(once.as_mut(), 5, scale_s) == run(again.as_mut(), 5, scale_s),
            "block 5 depends on block 0, scale {scale_s} S"
        );
    }
}

/// Parameters of an effect from its table.
fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, ProfileError> {
    table
        .try_into()
        .map_err(|e| ProfileError::Syntax(e.to_string().trim_end().to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Profile;

    /// The parameters of `as_built`, and for the faults, which it does not have, their own.
    fn parameters(name: &str) -> toml::Table {
        match name {
            "cell_faults" => toml::from_str("dead = [1]\nmis_seeded = [{ taxel = 2, seed = 2 }]").unwrap(),
            // the lag is state that a later block keeps: only a probability of 0 or 1 can conform
            "missed_clocks" => toml::from_str("taxels = [3]\nprobability = 0.0").unwrap(),
            _ => {
                let profile = Profile::named("as_built").unwrap();
                let table = profile.compressive.get(name).or(profile.raster.get(name)).unwrap();
                table.as_table().unwrap().clone()
            }
        }
    }

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
            streams: Streams::new(0),
            weights: Weights::new(WeightMode::Binary, Seeding::Address, 100),
        };
        let error = |text: &str| {
            build_chain(&toml::from_str(text).unwrap(), &session)
                .map(|_| ())
                .unwrap_err()
                .to_string()
        };
        assert!(error("[hum]").contains("known: cell_faults, "));
        assert!(error("adc = 10").contains("expected a table"));
        assert!(error("[rails]\nlimit = 3.0").contains("limit"));
        for (text, field) in [
            ("[rails]\nlimit_v = nan", "limit_v"),
            ("[rails]\nlimit_v = -1.0", "limit_v"),
            ("[memory]\nh1 = 0.1\nh2 = inf", "h2"),
            ("[memory]\nh1 = [0.2, 0.1]\nh2 = 0.0", "h1"),
            ("[idle_noise]\nsd_v = -0.1", "sd_v"),
            ("[contact_noise]\nfraction = nan", "fraction"),
            ("[drive_offset]\nconstant_v = [0.0, nan]\nasymmetry = 0.0", "constant_v"),
            (
                "[late_updates]\nrate = 0.5\nperiod_measurements = 52.0\nperiod_sd_measurements = 0.2",
                "rate",
            ),
            ("[cell_faults]\ndead = [100]", "taxel"),
            ("[missed_clocks]\ntaxels = [1]\nprobability = 2.0", "probability"),
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
