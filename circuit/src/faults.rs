//! The table of faults, and the effect that applies them to the signal.

mod dead;
mod detached;
mod drifting;
mod mis_seeded;
mod overdriven;
pub(crate) mod skipping_clocks;
mod stuck;

use crate::batch::Batch;
use crate::effect::{Effect, EffectSession, ProfileError};
use crate::fault::{BuildFault, Fault, FaultConfig};
use spts_models::in_section;

/// Every fault by name.
pub const FAULTS: &[(&str, BuildFault)] = &[
    ("dead", dead::build),
    ("stuck", stuck::build),
    ("mis_seeded", mis_seeded::build),
    ("overdriven", overdriven::build),
    ("skipping_clocks", skipping_clocks::build),
    ("drifting", drifting::build),
    ("detached", detached::build),
];

/// Names of [`FAULTS`], for messages.
fn known() -> String {
    let names: Vec<&str> = FAULTS.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Builds one effect for all faults in `configs`. It must be the first of the chain, because faults change what the
/// cells put out.
///
/// # Errors
/// [`ProfileError`] for an unknown fault, a taxel that the skin does not have, parameters outside their range, or a
/// second fault that determines the level of the same cell.
pub fn build_faults(configs: &[FaultConfig], session: &EffectSession) -> Result<Box<dyn Effect>, ProfileError> {
    let mut cells: Vec<FaultyCell> = Vec::new();
    for (index, config) in configs.iter().enumerate() {
        let taxel = config.taxel as usize;
        let fault = build_fault(index, config, session)?;
        let cell = match cells.iter_mut().find(|cell| cell.taxel == taxel) {
            Some(cell) => cell,
            None => cells.push_mut(FaultyCell {
                taxel,
                faults: Vec::new(),
            }),
        };
        if fault.drives() && cell.decided() {
            return Err(refused(
                index,
                config,
                "the cell has another fault that decides its level",
            ));
        }
        cell.faults.push(fault);
    }
    cells.sort_by_key(|cell| cell.taxel);
    Ok(Box::new(Faults { cells }))
}

fn build_fault(index: usize, config: &FaultConfig, session: &EffectSession) -> Result<Box<dyn Fault>, ProfileError> {
    let Some((_, build)) = FAULTS.iter().find(|(name, _)| *name == config.name) else {
        return Err(ProfileError::UnknownFault {
            index,
            name: config.name.clone(),
            known: known(),
        });
    };
    let taxels = session.weights.taxels();
    if config.taxel as usize >= taxels {
        let last = taxels.saturating_sub(1);
        return Err(refused(
            index,
            config,
            &format!("`taxel` = {} is outside [0, {last}]", config.taxel),
        ));
    }
    build(config.parameters.clone(), config.taxel, session).map_err(|e| refused(index, config, &e.to_string()))
}

fn refused(index: usize, config: &FaultConfig, reason: &str) -> ProfileError {
    ProfileError::Fault {
        fault: config.name.clone(),
        taxel: config.taxel,
        reason: in_section(&format!("faults[{index}]"), reason),
    }
}

struct FaultyCell {
    taxel: usize,
    faults: Vec<Box<dyn Fault>>,
}

impl FaultyCell {
    fn decided(&self) -> bool {
        self.faults.iter().any(|fault| fault.drives())
    }
}

struct Faults {
    /// In order of taxel.
    cells: Vec<FaultyCell>,
}

impl Effect for Faults {
    fn apply(&mut self, batch: &mut Batch<'_>) {
        for cell in &mut self.cells {
            batch.change(cell.taxel, cell.decided(), |run| {
                for fault in &mut cell.faults {
                    fault.apply(run);
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::check_effect;
    use crate::mode::WeightMode;
    use crate::seeding::Seeding;
    use crate::weights::Weights;
    use spts_models::Streams;

    fn session(mode: WeightMode) -> EffectSession {
        EffectSession {
            device: Streams::new(4),
            streams: Streams::new(4),
            weights: Weights::new(mode, Seeding::Address, 100),
            feedback_ohm: 1e3,
            sample_rate_hz: 1e3,
        }
    }

    fn faults(text: &str) -> Vec<FaultConfig> {
        let mut list: std::collections::BTreeMap<String, Vec<FaultConfig>> = toml::from_str(text).unwrap();
        list.remove("faults").unwrap()
    }

    #[test]
    fn every_fault_conforms() {
        for (name, _) in FAULTS {
            eprintln!("{name}");
            let configs = faults(&format!("[[faults]]\nname = \"{name}\"\ntaxel = 3"));
            check_effect(&|session| build_faults(&configs, session).unwrap());
        }
        // a cell that misses many edges, so that its lag is not 0
        let often = "[[faults]]\nname = \"skipping_clocks\"\ntaxel = 1\nprobability = 0.3\n";
        let configs = faults(&format!("{often}[[faults]]\nname = \"drifting\"\ntaxel = 1"));
        check_effect(&|session| build_faults(&configs, session).unwrap());
    }

    #[test]
    fn nonsense_is_refused_with_fault_and_taxel() {
        for (text, facts) in [
            (
                "name = \"lame\"\ntaxel = 1",
                ["`faults[0].name` = \"lame\"", "known: dead, stuck"],
            ),
            ("name = \"dead\"\ntaxel = 100", ["`faults[0].taxel` = 100", "[0, 99]"]),
            (
                "name = \"dead\"\ntaxel = 1\nseed = 2",
                ["fault `dead` of taxel 1", "seed"],
            ),
            (
                "name = \"stuck\"\ntaxel = 1\nlevel = 1.5",
                ["`faults[0].level` = 1.5", "[−1, 1]"],
            ),
            (
                "name = \"mis_seeded\"\ntaxel = 1\nseed = -1",
                ["mis_seeded", "`faults[0].seed` = -1: a whole number in [0, 2^32)"],
            ),
            (
                "name = \"overdriven\"\ntaxel = 1\ngain = 101.0",
                ["`faults[0].gain` = 101", "[−100, 100]"],
            ),
            (
                "name = \"skipping_clocks\"\ntaxel = 1\nprobability = nan",
                ["probability", "[0, 1]"],
            ),
            (
                "name = \"drifting\"\ntaxel = 1\nrate_per_s = 11.0",
                ["rate_per_s", "[−10, 10]"],
            ),
            (
                "name = \"dead\"\ntaxel = 1\n[[faults]]\nname = \"stuck\"\ntaxel = 1",
                ["fault `stuck` of taxel 1", "another fault"],
            ),
        ] {
            let error = build_faults(&faults(&format!("[[faults]]\n{text}")), &session(WeightMode::Binary));
            let message = error.map(|_| ()).unwrap_err().to_string();
            for fact in facts {
                assert!(message.contains(fact), "{text}: {message}");
            }
        }
    }
}
