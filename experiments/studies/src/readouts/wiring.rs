//! The wire for skins of one size: one clock for all readouts, and for each the largest feedback for which its sums
//! fit.

use crate::electronics::ElectronicsStudy;
use crate::explore::scene::ExploreScene;
use crate::explore::wiring::{Way, pressed_skin, wirings};
use spts_circuit::amplifier::{Amplifier, Budget, Network, Setting};
use spts_circuit::{Profile, Seeding, Span};
use spts_input::Refusal;
use spts_models::Streams;

/// Share of the range that the largest sum of the touches used for calibration takes: others are larger.
const HEADROOM: f64 = 0.7;
/// Largest feedback resistance, Ω: a hundred times that of as_designed.
const LARGEST_OHM: f64 = 1e5;
/// Halvings of the logarithm of the feedback's range: to a thousandth of a percent.
const HALVINGS: usize = 30;
/// Effects of as_built that no part explains, beside contact noise and late updates, which the wiring has already:
/// name, and the number that is drawn once a session.
const SESSION: [(&str, &str); 2] = [("contact_noise", "fraction"), ("idle_noise", "sd_v")];

/// Electronics and clock of the wire of a skin of one size, the same for all readout methods.
#[derive(Debug, Clone)]
pub struct SkinWire {
    /// Profile with the clock of this size. Its feedback is for sums with random signs.
    base: Profile,
    electronics: ElectronicsStudy,
    setting: Setting,
    amplifier: Amplifier,
    taxels: u32,
    /// Duration of a measurement, s.
    pub period_s: f64,
    /// Conductance of an untouched taxel, S.
    pub idle_s: f64,
}

/// The wire of one readout method: that of the skin, with the feedback resistance that suits the method's sums.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadoutWire {
    /// Profile, which is the same in both modes.
    pub profile: Profile,
    /// Feedback resistance, Ω.
    pub feedback_ohm: f64,
    /// Levels of the codes 0 and 255 according to the data sheet of the cells' converters.
    pub levels: [f64; 2],
    /// Relative noise of a contact in this session.
    pub contact_noise: f64,
}

impl SkinWire {
    /// The wire of `taxels` taxels. The feedback is reduced until the sums of the touch `largest_s` (conductances minus
    /// the idle skin's, S) with random signs fit, and the clock is slowed until they settle, as in
    /// [`explore`](crate::explore).
    ///
    /// # Errors
    /// [`Refusal`] if the electronics cannot be built.
    pub fn new(taxels: u32, largest_s: &[f64]) -> Result<Self, Refusal> {
        let electronics = ElectronicsStudy::as_designed()?;
        let scene = ExploreScene {
            image_s: largest_s.to_vec(),
            contacts: 1,
        };
        let wirings = wirings(taxels, &scene, Seeding::Mixed, &electronics)?;
        let fitted = wirings.into_iter().find(|wiring| wiring.way == Way::Fitted);
        let fitted = fitted.ok_or_else(|| no_number("amplifier", "feedback"))?;
        Ok(Self {
            setting: Setting {
                skin: pressed_skin(&scene, &electronics),
                adc: electronics.adc,
                available_s: fitted.period_s - electronics.busy_s,
            },
            amplifier: Amplifier::new(electronics.op_amp, electronics.network)?,
            base: fitted.profile,
            period_s: fitted.period_s,
            idle_s: electronics.skin.idle_s,
            electronics,
            taxels,
        })
    }

    /// Conductance of a fully pressed taxel, S.
    #[must_use]
    pub fn pressed_s(&self) -> f64 {
        self.electronics.skin.pressed_s
    }

    /// The wire of a readout with the largest sum `largest_sum_s`, S, in one session. The feedback is the largest for
    /// which the sum uses 70 % of the range of amplifier and converter, and the output settles within the clock's
    /// period.
    ///
    /// # Errors
    /// [`Refusal`] if the amplifier cannot be built, or a profile lacks a value.
    pub fn fitted(&self, largest_sum_s: f64, session: Streams) -> Result<ReadoutWire, Refusal> {
        let range_v = self.budget(self.amplifier.network().feedback_ohm)?.range_v;
        let fits = HEADROOM * range_v / (self.base.drive_v * largest_sum_s.max(f64::MIN_POSITIVE));
        let mut feedback_ohm = fits.min(LARGEST_OHM);
        if !self.settles(feedback_ohm)? {
            let (mut low, mut high) = (1.0_f64.min(feedback_ohm).ln(), feedback_ohm.ln());
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if self.settles(middle.exp())? {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            feedback_ohm = low.exp();
        }
        self.with_feedback(feedback_ohm, session)
    }

    fn budget(&self, feedback_ohm: f64) -> Result<Budget, Refusal> {
        let network = Network {
            feedback_ohm,
            ..*self.amplifier.network()
        };
        let amplifier = Amplifier::new(*self.amplifier.op_amp(), network)?;
        Ok(Budget::new(&amplifier, f64::from(self.taxels), &self.setting))
    }

    fn settles(&self, feedback_ohm: f64) -> Result<bool, Refusal> {
        let budget = self.budget(feedback_ohm)?;
        Ok(budget.settle_s + budget.slew_s <= self.setting.available_s * (1.0 + 1e-9))
    }

    /// The profile with what a session draws fixed, so that it is the same for all readouts and in both modes.
    fn with_feedback(&self, feedback_ohm: f64, session: Streams) -> Result<ReadoutWire, Refusal> {
        let built = Profile::named("as_built").map_err(Refusal::from_error)?;
        let mut profile = Profile {
            feedback_ohm,
            ..self.base.clone()
        };
        let mut contact_noise = 0.0;
        for (effect, number) in SESSION {
            let span = built.compressive.get(effect).and_then(|table| table.get(number));
            let span: Option<Span> = span.and_then(|value| value.clone().try_into().ok());
            let drawn = span
                .ok_or_else(|| no_number(effect, number))?
                .draw(&mut session.rng(effect, 0));
            if effect == "contact_noise" {
                contact_noise = drawn;
            }
            let mut table = toml::Table::new();
            table.insert(number.to_owned(), drawn.into());
            profile.compressive.insert(effect.to_owned(), toml::Value::Table(table));
        }
        profile.raster.clone_from(&profile.compressive);
        Ok(ReadoutWire {
            levels: levels(&profile)?,
            profile,
            feedback_ohm,
            contact_noise,
        })
    }
}

/// Middle levels of the codes 0 and 255 of the profile's converters: (c + errors − 127.5)/127.5, in steps.
fn levels(profile: &Profile) -> Result<[f64; 2], Refusal> {
    let number = |number: &'static str| {
        let value = profile.compressive.get("dac").and_then(|table| table.get(number));
        let middle = match value {
            Some(toml::Value::Float(value)) => Some(*value),
            Some(toml::Value::Array(ends)) => {
                let ends: Vec<f64> = ends.iter().filter_map(toml::Value::as_float).collect();
                (!ends.is_empty()).then(|| ends.iter().sum::<f64>() / ends.len() as f64)
            }
            _ => None,
        };
        middle.ok_or_else(|| no_number("dac", number))
    };
    let step_v = number("reference_v")? / 256.0;
    let (offset, gain) = (number("offset_v")? / step_v, number("gain_lsb")?);
    let low = offset.max(number("floor_v")? / step_v);
    Ok([low / 127.5 - 1.0, 1.0 + (offset + gain) / 127.5])
}

/// An effect that a profile lacks, or a value of it, as an error.
fn no_number(effect: &str, number: &str) -> Refusal {
    Refusal::new(format!(
        "profile as_built or as_designed: no `compressive.{effect}.{number}`"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wire(taxels: usize) -> SkinWire {
        let mut touch = vec![0.0; taxels];
        touch[..25].fill(150e-6);
        SkinWire::new(u32::try_from(taxels).unwrap(), &touch).unwrap()
    }

    /// By hand: 14.9 V · 0.7 / 3.3 V over the sum, unless the output would not settle.
    #[test]
    fn the_feedback_is_what_the_largest_sum_permits() {
        let small = wire(100);
        let fitted = small.fitted(25.0 * 150e-6, Streams::new(1)).unwrap();
        let expected = 0.7 * 14.9 / 3.3 / (25.0 * 150e-6);
        assert!(
            (fitted.feedback_ohm / expected - 1.0).abs() < 1e-9,
            "{} Ω",
            fitted.feedback_ohm
        );
        assert_eq!(fitted.profile.raster, fitted.profile.compressive);
        // half the sum has twice the feedback, as long as it settles, and never more
        let half = small.fitted(12.5 * 150e-6, Streams::new(1)).unwrap();
        assert!((half.feedback_ohm / expected - 2.0).abs() < 1e-9);
        let none = small.fitted(0.0, Streams::new(1)).unwrap();
        assert!(none.feedback_ohm < LARGEST_OHM && small.settles(none.feedback_ohm).unwrap());
        assert!(!small.settles(1.01 * none.feedback_ohm).unwrap());
    }

    /// A large skin loads the amplifier with what is idle, too.
    #[test]
    fn large_skins_are_not_faster() {
        assert!(wire(10_000).period_s >= wire(100).period_s);
    }

    /// A session is the same for all readouts, and another one has other noise.
    #[test]
    fn noise_is_of_the_session() {
        let wire = wire(100);
        let noise = |sum_s: f64, seed: u64| wire.fitted(sum_s, Streams::new(seed)).unwrap().contact_noise;
        assert!((noise(1e-3, 1) - noise(1e-2, 1)).abs() < f64::EPSILON);
        assert!((noise(1e-3, 1) - noise(1e-3, 2)).abs() > 1e-6);
        assert!((0.05..0.07).contains(&noise(1e-3, 1)));
    }

    /// By the data sheet's numbers: 0.2 V of 4.34 V are 11.8 of 256 steps, −20 mV are −1.18.
    #[test]
    fn levels_are_those_of_the_data_sheet() {
        let [low, high] = wire(100).fitted(1e-3, Streams::new(1)).unwrap().levels;
        assert!((low - (11.797 / 127.5 - 1.0)).abs() < 1e-4 && (high - (1.0 - 1.1797 / 127.5)).abs() < 1e-4);
    }
}
