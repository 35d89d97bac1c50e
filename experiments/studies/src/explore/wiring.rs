//! Ways to wire a large skin, as profiles of its readout.

use super::scene::ExploreScene;
use crate::electronics::ElectronicsStudy;
use serde::Serialize;
use spts_circuit::amplifier::{Amplifier, Budget, Limit, Network, Setting, Skin, fewest_wires};
use spts_circuit::{Profile, Seeding};
use spts_input::Refusal;

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
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    pub(crate) way: Way,
    pub(crate) wires: usize,
    /// Readout of every wire.
    pub(crate) profile: Profile,
    /// Duration of a measurement, s.
    pub(crate) period_s: f64,
    /// Feedback resistance, Ω.
    pub(crate) feedback_ohm: f64,
    /// 1 + Rf·ΣG of the wire with the most taxels.
    pub(crate) noise_gain: f64,
    /// Settling time to half a step of the converter, including slewing, s.
    pub(crate) settle_s: f64,
    /// Signal of a fully pressed taxel, in steps of the converter.
    pub(crate) steps_per_taxel: f64,
    /// Limit that the closed forms show as exceeded; `None` if there is none.
    pub(crate) limit: Option<Limit>,
}

/// The pressed skin of the closed forms with the ΣG and the ΣG² of `scene`.
pub(crate) fn pressed_skin(scene: &ExploreScene, electronics: &ElectronicsStudy) -> Skin {
    let (sum, squares) = scene.image_s.iter().fold((0.0, 0.0), |(s, q), g| (s + g, q + g * g));
    Skin {
        pressed_share: sum * sum / squares / scene.image_s.len() as f64,
        pressed_s: squares / sum,
        ..electronics.skin
    }
}

/// Every way to wire a skin of `taxels` taxels pressed as in `scene`; sub-arrays only where more than one wire is
/// needed.
pub(crate) fn wirings(
    taxels: u32,
    scene: &ExploreScene,
    seeding: Seeding,
    electronics: &ElectronicsStudy,
) -> Result<Vec<Wiring>, Refusal> {
    let setting = Setting {
        skin: pressed_skin(scene, electronics),
        adc: electronics.adc,
        available_s: electronics.available_s()?,
    };
    let designed = Amplifier::new(electronics.op_amp, electronics.network)?;
    let mut ways = Vec::new();
    for way in Way::ALL {
        let (amplifier, wires) = match way {
            Way::Ideal | Way::AsDesigned => (designed, 1),
            Way::Fitted => (fitted(&designed, taxels, &setting)?, 1),
            Way::Wires => {
                let fewest = fewest_wires(taxels, &setting, &|_| Ok(designed))?;
                (designed, fewest.wires)
            }
        };
        if way == Way::Wires && wires == 1 {
            continue;
        }
        let budget = Budget::new(&amplifier, f64::from(taxels.div_ceil(wires)), &setting);
        let settle_s = budget.settle_s + budget.slew_s;
        let available_s = match way {
            Way::Fitted => settle_s.max(setting.available_s),
            _ => setting.available_s,
        };
        let period_s = available_s + electronics.busy_s;
        let feedback_ohm = amplifier.network().feedback_ohm;
        let slowed = Setting { available_s, ..setting };
        ways.push(Wiring {
            way,
            wires: wires as usize,
            profile: profile(way, feedback_ohm, available_s, period_s, seeding)?,
            period_s,
            feedback_ohm,
            noise_gain: budget.noise_gain,
            settle_s,
            steps_per_taxel: feedback_ohm * electronics.skin.drive_v * electronics.skin.pressed_s
                / electronics.adc.lsb_v(),
            limit: match way {
                Way::Ideal => None,
                _ => Budget::new(&amplifier, f64::from(taxels.div_ceil(wires)), &slowed).limit,
            },
        });
    }
    Ok(ways)
}

/// The amplifier with a feedback, no larger than it is, at which the sum of the whole skin fits.
fn fitted(designed: &Amplifier, taxels: u32, setting: &Setting) -> Result<Amplifier, Refusal> {
    let budget = Budget::new(designed, f64::from(taxels), setting);
    let network = Network {
        // the sum is proportional to the feedback
        feedback_ohm: designed.network().feedback_ohm * (HEADROOM * budget.range_v / budget.excursion_v).min(1.0),
        ..*designed.network()
    };
    Amplifier::new(*designed.op_amp(), network)
}

/// as_designed with this feedback and clock, and with what the parts do not explain as the recordings show it: contact
/// noise and late updates.
fn profile(way: Way, feedback_ohm: f64, available_s: f64, period_s: f64, seeding: Seeding) -> Result<Profile, Refusal> {
    if way == Way::Ideal {
        return Ok(Profile {
            seeding,
            ..Profile::named("ideal")?
        });
    }
    let built = Profile::named("as_built")?;
    let mut profile = Profile {
        seeding,
        feedback_ohm,
        sample_rate_hz: 1.0 / period_s,
        ..Profile::named("as_designed")?
    };
    for effect in ["contact_noise", "late_updates"] {
        let table = built
            .compressive
            .get(effect)
            .ok_or_else(|| no_effect("as_built", effect))?;
        profile.compressive.insert(effect.to_owned(), table.clone());
    }
    let amplifier = profile
        .compressive
        .get_mut("amplifier")
        .and_then(toml::Value::as_table_mut);
    let lacking = |name| no_effect("as_designed", name);
    let amplifier = amplifier.ok_or_else(|| lacking("amplifier"))?;
    let update_s = amplifier.get("update_s").and_then(toml::Value::as_float);
    let sample_s = update_s.ok_or_else(|| lacking("amplifier.update_s"))? + available_s;
    amplifier.insert("sample_s".to_owned(), sample_s.into());
    Ok(profile)
}

/// An effect that a profile lacks, or a value of it, as an error.
fn no_effect(profile: &str, name: &str) -> Refusal {
    Refusal::new(format!("profile {profile}: no `compressive.{name}`"))
}
