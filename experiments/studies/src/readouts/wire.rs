//! The common wire as a readout sees it.

use crate::electronics::ElectronicsStudy;
use crate::touches::{Touch, TouchWire};
use crate::wiring::{Fitted, amplifier, bisected, pressed_skin, sums};
use rand_distr::{Distribution as _, StandardNormal};
use spts_circuit::amplifier::{Budget, Setting};
use spts_circuit::{CellCodes, CompressiveWeights, Mode, Patterns, Profile, Readout, Seeding, Span};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// Frames of the idle skin that the reference is the mean of.
const IDLE_FRAMES: usize = 4;
/// Measurements of the idle skin at least: its noise is estimated from them.
const IDLE_MEASUREMENTS: usize = 512;
/// Number of the idle skin's block; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 40;
/// Mean time between false alarms that is accepted, s.
const FALSE_ALARM_S: f64 = 10.0;

/// The samples of a few measurements during a held touch, and the threshold that tells a touch from noise.
#[derive(Debug, Clone, PartialEq)]
pub struct WireFrame {
    /// Samples minus those of the idle skin at the same rows, V.
    pub volts: Vec<f64>,
    /// Threshold beyond which a sample means a touch, V: on an idle skin fewer than one is expected in 10 s.
    pub alarm_v: f64,
}

impl WireFrame {
    /// The samples of a scan of a sheet with `cols` columns that belong to a contact, and 0 for all others. A contact
    /// consists of the samples beyond the alarm threshold and the positive ones next to them. On a large skin, noise
    /// would otherwise appear as taxels.
    pub fn contacts(&self, cols: usize) -> Vec<f64> {
        let mut image = vec![0.0; self.volts.len()];
        let cols = cols.max(1);
        let rows = self.volts.len() / cols;
        for (r, c) in (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c))) {
            if self.volts[r * cols + c] > self.alarm_v {
                for near in r.saturating_sub(1)..(r + 2).min(rows) {
                    let beside = near * cols + c.saturating_sub(1)..near * cols + (c + 2).min(cols);
                    let samples = self.volts[beside.clone()].iter();
                    image[beside].iter_mut().zip(samples).for_each(|(out, v)| *out = v.max(0.0));
                }
            }
        }
        image
    }

    /// `until_noticed` of the first `count` measurements, whose samples may have either sign.
    pub fn noticed(&self, count: usize) -> Option<f64> {
        let beyond: Vec<bool> = self.volts[..count].iter().map(|v| v.abs() > self.alarm_v).collect();
        super::until_noticed(&beyond)
    }
}

/// What the idle skin reads, once a session.
struct Idle {
    /// One value for each row of a frame, V.
    volts: Vec<f64>,
    /// Standard deviation of a sample minus its reference, V.
    sd_v: f64,
}

/// A wire with its parts in one session, while a touch is held. A [`WireReadout`](super::WireReadout) requests
/// measurements of one kind of rows from it, touch after touch, and has no access to the touch itself.
pub struct WireSession<'a> {
    /// Electronics and clock.
    pub skin: &'a SkinWire,
    /// Profile, which is the same in both modes. Its feedback resistance suits the readout's sums.
    pub profile: Profile,
    /// Levels of the codes 0 and 255 according to the data sheet of the cells' converters.
    pub levels: [f64; 2],
    /// Relative noise of a contact in this session.
    contact_noise: f64,
    device: Streams,
    /// Conductances of the touch minus those of the idle skin, S, and its number, which determines its noise.
    held: (Vec<f64>, u64),
    /// The readout, and its output without a touch; built with the first frame.
    frames: Option<(TouchWire, Idle)>,
}

impl WireSession<'_> {
    /// The wire while `touch` is held. `number` determines its noise.
    pub fn hold(&mut self, touch: &Touch, number: u64) -> &mut Self {
        self.held = (touch.conductance_s.values().to_vec(), number);
        self
    }

    /// Threshold for samples of this standard deviation: with Chernoff's bound of a Gaussian's two tails, 2 exp(−z²/2),
    /// no more than one sample in ten seconds lies beyond.
    fn alarm_v(&self, sd_v: f64) -> f64 {
        sd_v * (2.0 * (2.0 * FALSE_ALARM_S / self.skin.period_s).ln()).sqrt()
    }

    /// The samples of a frame of `measurements` rows of the whole skin, by the readout that `build` makes.
    fn frame(
        &mut self,
        measurements: usize,
        build: impl FnOnce(&Self) -> Result<Readout, Refusal>,
    ) -> Result<WireFrame, Refusal> {
        let (mut wire, idle) = match self.frames.take() {
            Some(frames) if frames.1.volts.len() == measurements => frames,
            _ => {
                let mut wire = TouchWire::of(build(self)?);
                let idle = self.idle(&mut wire, measurements)?;
                (wire, idle)
            }
        };
        let idle_s = self.skin.electronics.skin.idle_s;
        let pressed = self.held.0.iter().map(|g| g + idle_s).collect();
        let mut volts = wire.volts(self.map(pressed), self.held.1, measurements)?;
        volts.iter_mut().zip(&idle.volts).for_each(|(v, idle)| *v -= idle);
        let alarm_v = self.alarm_v(idle.sd_v);
        self.frames = Some((wire, idle));
        Ok(WireFrame { volts, alarm_v })
    }

    fn map(&self, values: Vec<f64>) -> ConductanceMap {
        ConductanceMap::from_values(self.skin.layout.rows(), self.skin.layout.cols(), values)
    }

    /// Frames of the idle skin: their mean, and how far single ones are from it.
    fn idle(&self, wire: &mut TouchWire, measurements: usize) -> Result<Idle, Refusal> {
        let frames = IDLE_FRAMES.max(IDLE_MEASUREMENTS.div_ceil(measurements));
        let mut volts = vec![0.0; measurements];
        let mut squares = 0.0;
        for frame in 0..frames as u64 {
            let idle = self.map(vec![self.skin.electronics.skin.idle_s; self.skin.layout.taxels()]);
            let frame = wire.volts(idle, IDLE_BLOCK + frame, measurements)?;
            for (sum, v) in volts.iter_mut().zip(frame) {
                *sum += v;
                squares += v * v;
            }
        }
        let count = frames as f64;
        volts.iter_mut().for_each(|v| *v /= count);
        let means: f64 = volts.iter().map(|v| count * v * v).sum();
        let variance = (squares - means).max(0.0) / ((count - 1.0) * measurements as f64);
        Ok(Idle { volts, sd_v: (variance * (1.0 + 1.0 / count)).sqrt() })
    }

    /// A raster frame: sample k has taxel k at level 1, and all others at 0.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub fn scan(&mut self) -> Result<WireFrame, Refusal> {
        self.frame(self.skin.layout.taxels(), |session| {
            Readout::new(&session.profile, Mode::Raster, &session.skin.layout, session.device, 0)
        })
    }

    /// A frame of `measurements` rows of ±1. All frames of a session must have the same kind of rows.
    ///
    /// # Errors
    /// [`Refusal`] if the rows belong to another skin.
    pub fn signs<R: CellCodes + Clone + 'static>(
        &mut self,
        rows: &R,
        measurements: usize,
    ) -> Result<WireFrame, Refusal> {
        self.frame(measurements, |session| {
            let profile = Profile { weights: CompressiveWeights::Binary, ..session.profile.clone() };
            let readout = Readout::new(&profile, Mode::Compressive, &session.skin.layout, session.device, 0)?;
            readout.with_codes(|_| Ok(Box::new(rows.clone())))
        })
    }

    /// Each cell's own measurement of its taxel, S: the conductance minus that of the idle skin, with the relative
    /// noise of a contact. It is for cells with a converter of their own; the receiver at the end of the wire does not
    /// know it.
    pub(crate) fn own_values_s(&self) -> Vec<f64> {
        let mut rng = self.device.rng("readouts/cells", self.held.1);
        let noisy = |g: &f64| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            g * (1.0 + self.contact_noise * normal)
        };
        self.held.0.iter().map(noisy).collect()
    }

    /// Random numbers for events that are not synchronised with a clock; different for every touch.
    pub fn moments(&self) -> Streams {
        self.device.child("readouts/moments", self.held.1)
    }

    /// Samples while a cell a taxel of `chips` puts out its codes through a resistor of its own with the conductance of
    /// a fully pressed taxel, and all other cells are off. `None` is a silent wire.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub(crate) fn transmissions(
        &mut self,
        chips: Option<&Patterns>,
        measurements: usize,
    ) -> Result<WireFrame, Refusal> {
        let published = SkinLayout::default();
        let line = |chips: &Patterns| -> Result<TouchWire, Refusal> {
            // the cells that transmit, whatever their places
            let layout = SkinLayout::new(1, chips.taxels(), published.pitch_m(), published.electrode_m())?;
            let readout = Readout::new(&self.profile, Mode::Raster, &layout, self.device, 0)?;
            Ok(TouchWire::of(readout.with_codes(|_| Ok(Box::new(chips.clone())))?))
        };
        let silent = Patterns::new(1, vec![NEUTRAL])?;
        let idle = line(&silent)?.volts(ConductanceMap::zeros(1, 1), IDLE_BLOCK, IDLE_MEASUREMENTS)?;
        let idle_v = idle.iter().sum::<f64>() / idle.len() as f64;
        let variance = idle.iter().map(|v| (v - idle_v).powi(2)).sum::<f64>() / (idle.len() - 1) as f64;
        let pressed_s = self.skin.electronics.skin.pressed_s;
        let (chips, each_s) = chips.map_or((&silent, 0.0), |chips| (chips, pressed_s));
        let map = ConductanceMap::from_values(1, chips.taxels(), vec![each_s; chips.taxels()]);
        let mut volts = line(chips)?.volts(map, self.held.1, measurements)?;
        volts.iter_mut().for_each(|v| *v -= idle_v);
        Ok(WireFrame { volts, alarm_v: self.alarm_v(variance.sqrt()) })
    }
}

/// Code of a cell that adds nothing.
pub(super) const NEUTRAL: u8 = 126;

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
    /// As designed.
    pub electronics: ElectronicsStudy,
    setting: Setting,
    /// Rows, columns and pitch.
    pub layout: SkinLayout,
    /// Duration of a measurement, s.
    pub period_s: f64,
}

impl SkinWire {
    /// The wire of a skin. The feedback is reduced until the sums of the touch `largest_s` (conductances minus the idle
    /// skin's, S) with random signs fit, and the clock is slowed until they settle.
    ///
    /// # Errors
    /// [`Refusal`] if the electronics cannot be built.
    pub fn new(layout: SkinLayout, largest_s: &[f64]) -> Result<Self, Refusal> {
        let electronics = ElectronicsStudy::as_designed()?;
        let fitted = Fitted::new(largest_s, Seeding::Mixed, &electronics)?;
        Ok(Self {
            setting: Setting {
                skin: pressed_skin(sums(largest_s), largest_s.len(), &electronics),
                adc: electronics.adc,
                available_s: fitted.period_s - electronics.busy_s,
            },
            base: fitted.profile,
            period_s: fitted.period_s,
            electronics,
            layout,
        })
    }

    /// Largest magnitude of Σ wₖ·gₖ that `readout` has with `touch`, S.
    pub(crate) fn largest_sum_s(&self, readout: &dyn super::WireReadout, touch: &Touch) -> f64 {
        let idle_s = self.electronics.skin.idle_s;
        let pressed: Vec<f64> = touch.conductance_s.values().iter().map(|g| g + idle_s).collect();
        readout.largest_sum_s(&pressed)
    }

    /// A session of a readout with the largest sum `largest_sum_s`, S. The feedback is the largest for which the sum
    /// uses 70 % of the range of amplifier and converter, and the output settles within the clock's period. `device`
    /// provides the random numbers; what a session draws is fixed in its profile, the same for all readouts.
    ///
    /// # Errors
    /// [`Refusal`] if the amplifier cannot be built, or a profile lacks a value.
    pub fn session(&self, largest_sum_s: f64, device: Streams) -> Result<WireSession<'_>, Refusal> {
        let session = device.child("session", 0);
        let built = Profile::named("as_built")?;
        let mut profile = Profile { feedback_ohm: self.feedback_ohm(largest_sum_s)?, ..self.base.clone() };
        let mut contact_noise = 0.0;
        for (effect, number) in SESSION {
            let drawn = span(&built, effect, number)?.draw(&mut session.rng(effect, 0));
            if effect == "contact_noise" {
                contact_noise = drawn;
            }
            let table = toml::Table::from_iter([(number.to_owned(), drawn.into())]);
            profile.compressive.insert(effect.to_owned(), table.into());
        }
        profile.raster.clone_from(&profile.compressive);
        Ok(WireSession {
            skin: self,
            levels: levels(&profile)?,
            profile,
            contact_noise,
            device,
            held: (Vec::new(), 0),
            frames: None,
        })
    }

    fn feedback_ohm(&self, largest_sum_s: f64) -> Result<f64, Refusal> {
        let range_v = self.budget(self.electronics.network.feedback_ohm)?.range_v;
        let fits = HEADROOM * range_v / (self.base.drive_v * largest_sum_s.max(f64::MIN_POSITIVE));
        let feedback_ohm = fits.min(LARGEST_OHM);
        if self.settles(feedback_ohm)? {
            return Ok(feedback_ohm);
        }
        let ends = [1.0_f64.min(feedback_ohm).ln(), feedback_ohm.ln()];
        Ok(bisected(ends, HALVINGS, |middle| self.settles(middle.exp()))?.exp())
    }

    fn budget(&self, feedback_ohm: f64) -> Result<Budget, Refusal> {
        let amplifier = amplifier(&self.electronics, feedback_ohm)?;
        Ok(Budget::new(&amplifier, self.layout.taxels() as f64, &self.setting))
    }

    fn settles(&self, feedback_ohm: f64) -> Result<bool, Refusal> {
        let budget = self.budget(feedback_ohm)?;
        Ok(budget.settle_s + budget.slew_s <= self.setting.available_s * (1.0 + 1e-9))
    }
}

/// Middle levels of the codes 0 and 255 of the profile's converters: (c + errors − 127.5)/127.5, in steps.
fn levels(profile: &Profile) -> Result<[f64; 2], Refusal> {
    let number = |number: &'static str| match span(profile, "dac", number)? {
        Span::Fixed(value) => Ok(value),
        Span::Between([low, high]) => Ok::<_, Refusal>(0.5 * (low + high)),
    };
    let step_v = number("reference_v")? / 256.0;
    let (offset, gain) = (number("offset_v")? / step_v, number("gain_lsb")?);
    let low = offset.max(number("floor_v")? / step_v);
    Ok([low / 127.5 - 1.0, 1.0 + (offset + gain) / 127.5])
}

/// What an effect of the profile draws a number from.
fn span(profile: &Profile, effect: &str, number: &str) -> Result<Span, Refusal> {
    let span = profile.compressive.get(effect).and_then(|table| table.get(number));
    let span = span.and_then(|value| value.clone().try_into().ok());
    span.ok_or_else(|| no_number(effect, number))
}

/// An effect that a profile lacks, or a value of it, as an error.
fn no_number(effect: &str, number: &str) -> Refusal {
    Refusal::new(format!("profile as_built or as_designed: no `compressive.{effect}.{number}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: one taxel of 3 × 4 beyond the alarm; the positive one at its corner counts, the one two columns further
    /// does not.
    #[test]
    fn contacts_are_what_is_beyond_the_alarm_and_beside_it() {
        let frame =
            WireFrame { volts: vec![2.0, -0.3, 0.0, 0.4, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.9], alarm_v: 1.0 };
        let expected = [2.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(frame.contacts(4), expected);
    }

    fn wire(side: usize) -> SkinWire {
        let mut touch = vec![0.0; side * side];
        touch[..25].fill(150e-6);
        SkinWire::new(SkinLayout::with_pitch(side, side, 15e-3).unwrap(), &touch).unwrap()
    }

    /// By hand: 14.9 V · 0.7 / 3.3 V over the sum, unless the output would not settle.
    #[test]
    fn the_feedback_is_what_the_largest_sum_permits() {
        let small = wire(10);
        let found = small.feedback_ohm(25.0 * 150e-6).unwrap();
        let expected = 0.7 * 14.9 / 3.3 / (25.0 * 150e-6);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} Ω");
        // half the sum has twice the feedback, as long as it settles, and never more
        let half = small.feedback_ohm(12.5 * 150e-6).unwrap();
        assert!((half / expected - 2.0).abs() < 1e-9);
        let none = small.feedback_ohm(0.0).unwrap();
        assert!(none < LARGEST_OHM && small.settles(none).unwrap());
        assert!(!small.settles(1.01 * none).unwrap());
        // a large skin loads the amplifier with what is idle, too
        assert!(wire(100).period_s >= small.period_s);
    }

    /// A session is the same for all readouts, and another one has other noise. Levels are by the data sheet's numbers:
    /// 0.2 V of 4.34 V are 11.8 of 256 steps, −20 mV are −1.18.
    #[test]
    fn noise_is_of_the_session() {
        let wire = wire(10);
        let session = |sum_s: f64, seed: u64| wire.session(sum_s, Streams::new(seed)).unwrap();
        let noise = |sum_s: f64, seed: u64| session(sum_s, seed).contact_noise;
        assert!((noise(1e-3, 1) - noise(1e-2, 1)).abs() < f64::EPSILON);
        assert!((noise(1e-3, 1) - noise(1e-3, 2)).abs() > 1e-6);
        // every session of as_built has a value from this span
        assert!((0.04225..=0.07291).contains(&noise(1e-3, 1)));
        let [low, high] = session(1e-3, 1).levels;
        assert!((low - (11.797 / 127.5 - 1.0)).abs() < 1e-4 && (high - (1.0 - 1.1797 / 127.5)).abs() < 1e-4);
    }
}
