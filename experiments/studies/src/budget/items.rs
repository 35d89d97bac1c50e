//! The parts of the chain that can be disabled, and their stages.

use spts_circuit::{EFFECTS, FAULTS, Profile};
use spts_eval::unique;

/// Name of the stage between mechanics and transducer.
pub const CONTACT: &str = "contact";
/// Name of the stage between pressure and conductance.
pub(super) const TRANSDUCER: &str = "transducer";
/// Name of the stage of the faults of single cells.
const CELLS: &str = "faults";
/// Stage of a readout effect that [`READOUT_STAGES`] does not list.
const OTHER: &str = "other";

/// Parts of the transducer, each with the parameters (TOML) that take it away.
pub(super) const PARTS: &[(&str, &str)] = &[
    ("spread", "spread_log_sd = 0.0"),
    ("session", "session_log_sd = 0.0"),
    ("hysteresis", "hysteresis.operators = 0"),
    ("creep", "creep = { per_decade = 0.0, instant = 1.0 }"),
    ("conditioning", "conditioning = { first = 1.0, per_ln_press = 0.0 }"),
];

/// Stages of the readout in signal order, and their effects.
const READOUT_STAGES: &[(&str, &[&str])] = &[
    ("drive", &["missed_clocks", "late_updates", "dac", "drive_offset"]),
    ("amplifier", &["memory", "clock_pattern", "amplifier", "rails"]),
    ("noise", &["contact_noise", "idle_noise"]),
    ("converter", &["adc", "clamp"]),
];

/// One part that can be taken away: of the transducer, all faults of one name, or an effect of the readout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BudgetItem {
    /// Its stage.
    pub(super) stage: &'static str,
    /// Its name.
    pub(super) name: &'static str,
}

/// Everything that acts on a compressive recording with `profile`: the transducer's parts, then the faults, then the
/// effects, stage by stage.
pub(super) fn items(profile: &Profile) -> Vec<BudgetItem> {
    let parts = PARTS.iter().map(|&(name, _)| BudgetItem {
        stage: TRANSDUCER,
        name,
    });
    let listed = EFFECTS
        .iter()
        .filter(|(name, _)| profile.compressive.contains_key(*name));
    let mut effects: Vec<BudgetItem> = listed
        .map(|&(name, _)| BudgetItem {
            stage: stage_of(name),
            name,
        })
        .collect();
    // stable: signal order within a stage
    effects.sort_by_key(|item| READOUT_STAGES.iter().position(|(stage, _)| *stage == item.stage));
    let present = FAULTS
        .iter()
        .filter(|(name, _)| profile.faults.iter().any(|f| f.name == *name));
    let faults = present.map(|&(name, _)| BudgetItem { stage: CELLS, name });
    parts.chain(faults).chain(effects).collect()
}

/// Takes an item of the readout out of a profile's compressive mode.
pub(super) fn take_away(item: BudgetItem, profile: &mut Profile) {
    if item.stage == CELLS {
        profile.faults.retain(|fault| fault.name != item.name);
    } else {
        profile.compressive.remove(item.name);
    }
}

/// Stages of `items`, each once, in their order.
pub(super) fn stages(items: &[BudgetItem]) -> Vec<&'static str> {
    unique(items.iter().map(|item| item.stage))
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
    use spts_circuit::PROFILES;
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
        let (_, text) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
        let faults = "[[faults]]\nname = \"dead\"\ntaxel = 4\n[[faults]]\nname = \"dead\"\ntaxel = 7\n";
        let mut profile = Profile::from_toml(&format!("{text}\n{faults}")).unwrap();
        let found = items(&profile);
        assert_eq!(
            stages(&found),
            [TRANSDUCER, CELLS, "drive", "amplifier", "noise", "converter"]
        );
        assert_eq!(found.iter().filter(|item| item.stage == CELLS).count(), 1);
        for &item in found.iter().filter(|item| item.stage != TRANSDUCER) {
            take_away(item, &mut profile);
        }
        assert!(profile.faults.is_empty() && profile.compressive.is_empty() && !profile.raster.is_empty());
    }
}
