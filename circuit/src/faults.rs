//! The table of faults of single cells, and the effect that applies them to the signal.

use crate::batch::{Batch, CellRun};
use crate::effect::{BuildFault, Effect, EffectSession, Fault, FaultConfig, parsed};
use crate::effects::SkippingClocks;
use crate::weights::WeightMode;
use serde::Deserialize;
use spts_input::Refusal;
use spts_models::{in_section, within};

/// Every fault by name.
pub const FAULTS: &[(&str, BuildFault)] = &[
    ("dead", dead),
    ("stuck", stuck),
    ("mis_seeded", mis_seeded),
    ("overdriven", overdriven),
    ("skipping_clocks", skipping_clocks),
    ("drifting", drifting),
    ("detached", detached),
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
/// [`Refusal`] for an unknown fault, a taxel that the skin does not have, parameters outside their range, or a
/// second fault that determines the level of the same cell.
pub(crate) fn build_faults(configs: &[FaultConfig], session: &EffectSession) -> Result<Box<dyn Effect>, Refusal> {
    let mut cells: Vec<FaultyCell> = Vec::new();
    for (index, config) in configs.iter().enumerate() {
        let taxel = config.taxel as usize;
        let fault = build_fault(index, config, session)?;
        let cell = match cells.iter_mut().find(|cell| cell.taxel == taxel) {
            Some(cell) => cell,
            None => cells.push_mut(FaultyCell { taxel, faults: Vec::new() }),
        };
        if fault.drives() && cell.decided() {
            return Err(refused(index, config, "the cell has another fault that decides its level"));
        }
        cell.faults.push(fault);
    }
    cells.sort_by_key(|cell| cell.taxel);
    Ok(Box::new(Faults { cells }))
}

fn build_fault(index: usize, config: &FaultConfig, session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let Some((_, build)) = FAULTS.iter().find(|(name, _)| *name == config.name) else {
        return Err(Refusal::new(format!(
            "`faults[{index}].name` = \"{}\" is not a fault; known: {}",
            config.name,
            known()
        )));
    };
    let taxels = session.weights.taxels();
    if config.taxel as usize >= taxels {
        let last = taxels.saturating_sub(1);
        return Err(refused(index, config, &format!("`taxel` = {} is outside [0, {last}]", config.taxel)));
    }
    build(config.parameters.clone(), config.taxel, session).map_err(|e| refused(index, config, &e.to_string()))
}

fn refused(index: usize, config: &FaultConfig, reason: &str) -> Refusal {
    let reason = in_section(&format!("faults[{index}]"), reason);
    Refusal::new(format!("{reason} (fault `{}` of taxel {})", config.name, config.taxel))
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

/// Parameters of a fault that has none.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}

/// The cell's output never changes.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stuck {
    /// The level: −1 is code 0, 1 is code 255. Range [−1, 1]; default 1.
    #[serde(default = "high")]
    level: f64,
}

fn high() -> f64 {
    1.0
}

/// The cell's output stays at mid-scale, level 0, as before its first clock edge.
fn dead(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    parsed::<Nothing>(table)?;
    Ok(Box::new(Stuck { level: 0.0 }))
}

fn stuck(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let stuck: Stuck = parsed(table)?;
    within("level", stuck.level, -1.0, 1.0, "[−1, 1]")?;
    Ok(Box::new(stuck))
}

impl Fault for Stuck {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        run.levels.fill(self.level);
    }
}

/// The cell's generator was loaded with another number. In one published session a cell runs on seed 2: it took the
/// mode byte for its seed. A raster scan uses no seed and is not disturbed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MisSeededConfig {
    /// Seed of the generator. Range [0, 2³² − 1]; default 2.
    #[serde(default = "mode_byte")]
    seed: u32,
}

fn mode_byte() -> u32 {
    2
}

struct MisSeeded {
    mode: WeightMode,
    seed: u32,
}

fn mis_seeded(table: toml::Table, _taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let (mode, seed) = (session.weights.mode(), parsed::<MisSeededConfig>(table)?.seed);
    Ok(Box::new(MisSeeded { mode, seed }))
}

impl Fault for MisSeeded {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        if self.mode == WeightMode::Raster {
            return;
        }
        for (row, level, _) in run.iter_mut() {
            *level = self.mode.level_from_seed(self.seed, row);
        }
    }
}

/// The cell puts out clamp(gain·aₙ + carry·aₙ₋₁ + bias, −1, 1), a being the analog level of a generator that was loaded
/// with `seed`. The defaults are measured on the cell of one published session that took the mode byte for its seed;
/// why it subtracts a share of its level before is not known. A raster scan is not disturbed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct OverdrivenConfig {
    /// Seed of the generator. Range [0, 2³² − 1].
    seed: u32,
    /// Gain on the present level. Range [−100, 100].
    gain: f64,
    /// Gain on the previous level. Range [−100, 100].
    carry: f64,
    /// Output at level 0. Range [−1, 1].
    bias: f64,
}

impl Default for OverdrivenConfig {
    fn default() -> Self {
        Self { seed: 2, gain: 1.58, carry: -0.71, bias: 0.08 }
    }
}

struct Overdriven {
    mode: WeightMode,
    config: OverdrivenConfig,
}

fn overdriven(table: toml::Table, _taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let config: OverdrivenConfig = parsed(table)?;
    for (field, value) in [("gain", config.gain), ("carry", config.carry)] {
        within(field, value, -100.0, 100.0, "[−100, 100]")?;
    }
    within("bias", config.bias, -1.0, 1.0, "[−1, 1]")?;
    Ok(Box::new(Overdriven { mode: session.weights.mode(), config }))
}

impl Fault for Overdriven {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        if self.mode == WeightMode::Raster {
            return;
        }
        let c = &self.config;
        let analog = |row: u64| WeightMode::Analog.level_from_seed(c.seed, row);
        // before the first edge the cell holds mid-scale
        let mut before = run.first_row.checked_sub(1).map_or(0.0, analog);
        for (row, level, _) in run.iter_mut() {
            let now = analog(row);
            *level = (c.gain * now + c.carry * before + c.bias).clamp(-1.0, 1.0);
            before = now;
        }
    }
}

/// Two edges that arrive before a cell has cleared its interrupt flag collapse into one: the cell is out of step until
/// it is seeded again. One cell of one published session lags by 30, 38 and 43 measurements, about 4e-5 missed edges.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SkippingConfig {
    /// Probability that the cell misses an edge. Range [0, 1]; default 4e-5.
    #[serde(default = "measured")]
    probability: f64,
}

fn measured() -> f64 {
    4e-5
}

fn skipping_clocks(table: toml::Table, taxel: u32, session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let config: SkippingConfig = parsed(table)?;
    Ok(Box::new(SkippingClocks::new(session, taxel, config.probability)?))
}

impl Fault for SkippingClocks {
    fn apply(&mut self, run: &mut CellRun<'_>) {
        self.fill(run.first_row, run.levels);
    }
}

/// The taxel contributes nothing, neither to the weighted sum nor to Σx nor to the contact noise.
struct Detached;

fn detached(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    parsed::<Nothing>(table)?;
    Ok(Box::new(Detached))
}

impl Fault for Detached {
    fn drives(&self) -> bool {
        false
    }

    fn apply(&mut self, run: &mut CellRun<'_>) {
        run.gains.fill(0.0);
    }
}

/// The taxel's contribution is multiplied by max(0, 1 + rate·t), t seconds after the seeds were loaded.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Drifting {
    /// Relative change a second, 1/s. Range [−10, 10]; default −0.01.
    #[serde(default = "slow_loss")]
    rate_per_s: f64,
}

fn slow_loss() -> f64 {
    -0.01
}

fn drifting(table: toml::Table, _taxel: u32, _session: &EffectSession) -> Result<Box<dyn Fault>, Refusal> {
    let drifting: Drifting = parsed(table)?;
    let rate = drifting.rate_per_s;
    within("rate_per_s", rate, -10.0, 10.0, "[−10, 10]")?;
    Ok(Box::new(drifting))
}

impl Fault for Drifting {
    fn drives(&self) -> bool {
        false
    }

    fn apply(&mut self, run: &mut CellRun<'_>) {
        let period_s = run.period_s;
        for (row, _, gain) in run.iter_mut() {
            *gain *= (1.0 + self.rate_per_s * (row as f64 * period_s)).max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::check_effect;
    use crate::weights::{Seeding, Weights};

    fn session(mode: WeightMode) -> EffectSession {
        EffectSession::of(4, Weights::new(mode, Seeding::Address, 100))
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

    /// Faults, with semicolons for line ends, and what the error says.
    const NONSENSE: &str = r#"
name = "lame"; taxel = 1 | `faults[0].name` = "lame" | known: dead, stuck
name = "dead"; taxel = 100 | `faults[0].taxel` = 100 | [0, 99]
name = "dead"; taxel = 1; seed = 2 | fault `dead` of taxel 1 | seed
name = "stuck"; taxel = 1; level = 1.5 | `faults[0].level` = 1.5 | [−1, 1]
name = "mis_seeded"; taxel = 1; seed = -1 | mis_seeded | `faults[0].seed` = -1: a whole number in [0, 2^32)
name = "overdriven"; taxel = 1; gain = 101.0 | `faults[0].gain` = 101 | [−100, 100]
name = "skipping_clocks"; taxel = 1; probability = nan | probability | [0, 1]
name = "drifting"; taxel = 1; rate_per_s = 11.0 | rate_per_s | [−10, 10]
name = "dead"; taxel = 1; [[faults]]; name = "stuck"; taxel = 1 | fault `stuck` of taxel 1 | another fault
"#;

    #[test]
    fn nonsense_is_refused_with_fault_and_taxel() {
        for line in NONSENSE.trim().lines() {
            let mut parts = line.split(" | ");
            let text = format!("[[faults]]\n{}", parts.next().unwrap().replace("; ", "\n"));
            let error = build_faults(&faults(&text), &session(WeightMode::Binary));
            let message = error.map(|_| ()).unwrap_err().to_string();
            for fact in parts {
                assert!(message.contains(fact), "{line}: {message}");
            }
        }
    }
}
