//! Wires of large skins: the feedback with which the sums fit, the clock with which the output settles, and the profile
//! of the readout that has both.

use crate::electronics::ElectronicsStudy;
use serde::Serialize;
use spts_circuit::amplifier::{Amplifier, Budget, Limit, Network, Setting, Skin, fewest_wires};
use spts_circuit::{PROFILES, Profile, Seeding};
use spts_input::Refusal;
use spts_models::parsed_text;
use toml::{Table, Value};

/// Share of the converter's range that a fitted feedback uses: the sum is Gaussian, and scenes differ.
const HEADROOM: f64 = 0.8;

/// How a skin is wired: ideal, on one wire, or on several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// y = Φx on one wire without electronics: the requirements of the decoder alone.
    Ideal,
    /// One wire with the amplifier and the clock of `as_designed`.
    AsDesigned,
    /// One wire whose feedback is reduced until the sum fits the converter, and whose clock is slowed until the output
    /// settles.
    Fitted,
    /// As many wires as the parts of `as_designed` need, each for a band of the skin's rows, read in parallel.
    Wires,
}

impl Way {
    /// Every wiring.
    pub const ALL: [Self; 4] = [Self::Ideal, Self::AsDesigned, Self::Fitted, Self::Wires];

    /// The wiring in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal wire",
            Self::AsDesigned => "one wire, as designed",
            Self::Fitted => "one wire, fitted",
            Self::Wires => "sub-arrays",
        }
    }
}

/// A wired skin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wiring {
    /// Wiring.
    pub way: Way,
    /// Wires.
    pub wires: usize,
    /// Limit that the amplifier's closed forms show as exceeded; `None` if there is none.
    pub limit: Option<Limit>,
    /// Feedback resistance, Ω.
    pub feedback_ohm: f64,
    /// 1 + Rf·ΣG of the wire with the most taxels.
    pub noise_gain: f64,
    /// Settling time to half a step of the converter, including slewing, s.
    pub settle_s: f64,
    /// Duration of a measurement, s.
    pub period_s: f64,
    /// Signal of a fully pressed taxel, in steps of the converter.
    pub steps_per_taxel: f64,
    /// Readout of every wire.
    #[serde(skip)]
    pub(crate) profile: Profile,
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

/// Every way to wire a skin whose taxels have the conductances `image_s` above those of the idle skin; sub-arrays only
/// where more than one wire is needed.
pub(crate) fn wirings(
    image_s: &[f64],
    seeding: Seeding,
    electronics: &ElectronicsStudy,
) -> Result<Vec<Wiring>, Refusal> {
    let taxels = u32::try_from(image_s.len()).unwrap_or(u32::MAX);
    let setting = Setting {
        skin: pressed_skin(sums(image_s), image_s.len(), electronics),
        adc: electronics.adc,
        available_s: electronics.available_s()?,
    };
    let designed_ohm = electronics.network.feedback_ohm;
    let designed = amplifier(electronics, designed_ohm)?;
    let mut ways = Vec::new();
    for way in Way::ALL {
        let (amplifier, wires) = match way {
            Way::Ideal | Way::AsDesigned => (designed, 1),
            Way::Fitted => {
                let budget = Budget::new(&designed, f64::from(taxels), &setting);
                // the sum is proportional to the feedback
                let share = (HEADROOM * budget.range_v / budget.excursion_v).min(1.0);
                (amplifier(electronics, designed_ohm * share)?, 1)
            }
            Way::Wires => (designed, fewest_wires(taxels, &setting, &|_| Ok(designed))?.wires),
        };
        if way == Way::Wires && wires == 1 {
            continue;
        }
        let budget = |setting: &Setting| Budget::new(&amplifier, f64::from(taxels.div_ceil(wires)), setting);
        let own = budget(&setting);
        let settle_s = own.settle_s + own.slew_s;
        let available_s = match way {
            Way::Fitted => settle_s.max(setting.available_s),
            _ => setting.available_s,
        };
        let period_s = available_s + electronics.busy_s;
        let feedback_ohm = amplifier.network().feedback_ohm;
        let profile = if way == Way::Ideal {
            Profile::named("ideal")?
        } else {
            let table = profile(feedback_ohm, 1.0 / period_s, available_s, &["late_updates", "contact_noise"])?;
            table.try_into().map_err(Refusal::from_error)?
        };
        ways.push(Wiring {
            way,
            wires: wires as usize,
            limit: budget(&Setting { available_s, ..setting }).limit.filter(|_| way != Way::Ideal),
            feedback_ohm,
            noise_gain: own.noise_gain,
            settle_s,
            period_s,
            steps_per_taxel: feedback_ohm * electronics.skin.drive_v * electronics.skin.pressed_s
                / electronics.adc.lsb_v(),
            profile: Profile { seeding: Some(seeding), ..profile },
        });
    }
    Ok(ways)
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
