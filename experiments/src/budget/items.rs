//! What can be taken away from the chain, and the stage that each part belongs to.

use spts_circuit::{EFFECTS, Profile};

/// Name of the stage between mechanics and transducer.
pub(super) const CONTACT: &str = "contact";
/// Name of the stage between pressure and conductance.
pub(super) const TRANSDUCER: &str = "transducer";
/// Stage of a readout effect that [`READOUT_STAGES`] does not list.
const OTHER: &str = "other";

/// Parts of the transducer, each with the parameters (TOML) that take it away.
pub(super) const PARTS: &[(&str, &str)] = &[
    ("spread", "spread_log_sd = 0.0"),
    ("hysteresis", "hysteresis.operators = 0"),
    ("creep", "creep = { per_decade = 0.0, instant = 1.0 }"),
    ("conditioning", "conditioning = { first = 1.0, per_ln_press = 0.0 }"),
];

/// Stages of the readout in signal order, and their effects.
const READOUT_STAGES: &[(&str, &[&str])] = &[
    ("faults", &["cell_faults", "missed_clocks"]),
    ("drive", &["late_updates", "drive_offset"]),
    ("amplifier", &["memory", "clock_pattern", "rails"]),
    ("noise", &["contact_noise", "idle_noise"]),
    ("converter", &["adc", "clamp"]),
];

/// One part that can be taken away: of the transducer, or an effect of the readout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Item {
    /// Its stage.
    pub(super) stage: &'static str,
    /// Its name.
    pub(super) name: &'static str,
}

/// Everything that acts on a compressive recording with `profile`: the transducer's parts, then the effects, stage by stage.
pub(super) fn items(profile: &Profile) -> Vec<Item> {
    let parts = PARTS.iter().map(|&(name, _)| Item {
        stage: TRANSDUCER,
        name,
    });
    let listed = EFFECTS
        .iter()
        .filter(|(name, _)| profile.compressive.contains_key(*name));
    let mut effects: Vec<Item> = listed
        .map(|&(name, _)| Item {
            stage: stage_of(name),
            name,
        })
        .collect();
    // stable: signal order within a stage
    effects.sort_by_key(|item| READOUT_STAGES.iter().position(|(stage, _)| *stage == item.stage));
    parts.chain(effects).collect()
}

/// Stages of `items`, each once, in their order.
pub(super) fn stages(items: &[Item]) -> Vec<&'static str> {
    let mut stages: Vec<&'static str> = Vec::new();
    for item in items {
        if !stages.contains(&item.stage) {
            stages.push(item.stage);
        }
    }
    stages
}

fn stage_of(effect: &str) -> &'static str {
    let found = READOUT_STAGES.iter().find(|(_, effects)| effects.contains(&effect));
    found.map_or(OTHER, |(stage, _)| stage)
}

/// Transducer parameters without the parts called `off`.
pub(super) fn without_parts(off: &[&str]) -> Result<toml::Table, toml::de::Error> {
    let texts = PARTS.iter().filter(|(name, _)| off.contains(name));
    let text: Vec<&str> = texts.map(|(_, text)| *text).collect();
    toml::from_str(&text.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_models::{SkinLayout, Streams, build_transducer};

    #[test]
    fn every_effect_has_a_stage() {
        for (name, _) in EFFECTS {
            assert_ne!(stage_of(name), OTHER, "{name}");
        }
    }

    #[test]
    fn the_transducer_knows_every_part() {
        for (name, _) in PARTS {
            let parameters = without_parts(&[name]).unwrap();
            build_transducer("velostat", parameters, &SkinLayout::default(), Streams::new(0)).unwrap();
        }
        let off: Vec<&str> = PARTS.iter().map(|(name, _)| *name).collect();
        assert_eq!(without_parts(&off).unwrap().len(), PARTS.len());
    }

    #[test]
    fn stages_stand_in_signal_order() {
        let found = stages(&items(&Profile::named("as_built").unwrap()));
        assert_eq!(found, [TRANSDUCER, "drive", "amplifier", "noise", "converter"]);
    }
}
