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

use crate::effect::{BuildEffect, Effect, ProfileError, Session};
use serde::de::DeserializeOwned;

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

/// Parameters of an effect from its table.
fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, ProfileError> {
    table
        .try_into()
        .map_err(|e| ProfileError::Syntax(e.to_string().trim_end().to_owned()))
}
