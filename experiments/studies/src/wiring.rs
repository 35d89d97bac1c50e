//! Wires of large skins: the feedback with which the sums fit, the clock with which the output settles, and the profile
//! of the readout that has both.

use crate::electronics::ElectronicsStudy;
use spts_circuit::amplifier::{Amplifier, Budget, Network, Setting, Skin};
use spts_circuit::{PROFILES, Profile, Seeding};
use spts_input::Refusal;
use spts_models::{parsed, parsed_text};
use toml::{Table, Value};

/// Share of the converter's range that a fitted feedback uses: the sum is Gaussian, and scenes differ.
const HEADROOM: f64 = 0.8;

/// One wire whose feedback is reduced until the sum of a skin fits the converter, and whose clock is slowed until the
/// output settles.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    /// Duration of a measurement, s.
    pub(crate) period_s: f64,
    /// The readout.
    pub(crate) profile: Profile,
}

impl Fitted {
    /// For a skin whose taxels have the conductances `image_s` above those of the idle skin.
    pub(crate) fn new(image_s: &[f64], seeding: Seeding, electronics: &ElectronicsStudy) -> Result<Self, Refusal> {
        let setting = Setting {
            skin: pressed_skin(sums(image_s), image_s.len(), electronics),
            adc: electronics.adc,
            available_s: electronics.available_s()?,
        };
        let designed_ohm = electronics.network.feedback_ohm;
        let taxels = image_s.len() as f64;
        let budget = Budget::new(&amplifier(electronics, designed_ohm)?, taxels, &setting);
        // the sum is proportional to the feedback
        let share = (HEADROOM * budget.range_v / budget.excursion_v).min(1.0);
        let amplifier = amplifier(electronics, designed_ohm * share)?;
        let own = Budget::new(&amplifier, taxels, &setting);
        let available_s = (own.settle_s + own.slew_s).max(setting.available_s);
        let period_s = available_s + electronics.busy_s;
        let effects = ["late_updates", "contact_noise"];
        let table = profile(amplifier.network().feedback_ohm, 1.0 / period_s, available_s, &effects)?;
        let profile: Profile = parsed(table)?;
        Ok(Self { period_s, profile: Profile { seeding: Some(seeding), ..profile } })
    }
}

/// ΣG and ΣG² of taxels, S and S².
pub(crate) fn sums(conductance_s: &[f64]) -> (f64, f64) {
    conductance_s.iter().fold((0.0, 0.0), |(sum, squares), g| (sum + g, squares + g * g))
}

/// The pressed skin of the closed forms whose `taxels` taxels have this ΣG and ΣG².
pub(crate) fn pressed_skin((sum_s, squares): (f64, f64), taxels: usize, electronics: &ElectronicsStudy) -> Skin {
    Skin {
        pressed_share: (sum_s * sum_s / squares / taxels as f64).min(1.0),
        pressed_s: squares / sum_s,
        ..electronics.skin
    }
}

/// The amplifier as designed with another feedback.
pub(crate) fn amplifier(electronics: &ElectronicsStudy, feedback_ohm: f64) -> Result<Amplifier, Refusal> {
    let network = Network { feedback_ohm, ..electronics.network };
    Amplifier::new(electronics.op_amp, network)
}

/// The largest number at which `works`, which it does at `low` and does not at `high`, by so many halvings.
pub(crate) fn bisected(
    [mut low, mut high]: [f64; 2],
    halvings: usize,
    works: impl Fn(f64) -> Result<bool, Refusal>,
) -> Result<f64, Refusal> {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if works(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(low)
}

/// as_designed with this feedback and clock, whose output has `available_s` of a measurement to settle. The `effects`
/// are those that the parts do not explain: in the compressive mode as the recordings of the device show them,
/// as_built.
pub(crate) fn profile(feedback_ohm: f64, rate_hz: f64, available_s: f64, effects: &[&str]) -> Result<Table, Refusal> {
    let (mut table, built) = (shipped("as_designed")?, shipped("as_built")?);
    table.insert("sample_rate_hz".to_owned(), rate_hz.into());
    table.insert("feedback_ohm".to_owned(), feedback_ohm.into());
    for mode in ["compressive", "raster"] {
        let lacking = |profile: &str, name: &str| Refusal::new(format!("profile {profile}: no `{mode}.{name}`"));
        let chain = table.get_mut(mode).and_then(Value::as_table_mut);
        let chain = chain.ok_or_else(|| lacking("as_designed", ""))?;
        for effect in effects {
            let shown = built.get(mode).and_then(|chain| chain.get(*effect));
            let shown = shown.ok_or_else(|| lacking("as_built", effect))?;
            chain.insert((*effect).to_owned(), shown.clone());
        }
        let amplifier = chain.get_mut("amplifier").and_then(Value::as_table_mut);
        let amplifier = amplifier.ok_or_else(|| lacking("as_designed", "amplifier"))?;
        let update_s = amplifier.get("update_s").and_then(Value::as_float);
        let update_s = update_s.ok_or_else(|| lacking("as_designed", "amplifier.update_s"))?;
        amplifier.insert("sample_s".to_owned(), (update_s + available_s).into());
    }
    Ok(table)
}

/// A shipped profile as a table.
pub(crate) fn shipped(name: &str) -> Result<Table, Refusal> {
    let text = PROFILES.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text);
    parsed_text(text).map_err(|refusal| refusal.at(name))
}
