//! The common wire as an entrant sees it.

use super::rows::OneByOne;
use super::tasks::{Fault, Task, Trial};
use super::{Entrant, UNIT_S};
use crate::electronics::ElectronicsStudy;
use crate::touches::{Touch, TouchWire};
use crate::wiring::{Fitted, amplifier, bisected, pressed_skin, sums};
use rand_distr::{Distribution as _, StandardNormal};
use spts_circuit::amplifier::{Budget, Setting};
use spts_circuit::{
    CellCodes, CompressiveWeights, Interpolated, Mode, Patterns, Profile, Readout, Seeding, Span, Weights, Wires,
};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Frames of the idle skin that the reference is the mean of.
const IDLE_FRAMES: usize = 4;
/// Measurements of the idle skin at least: its noise is estimated from them.
const IDLE_MEASUREMENTS: usize = 512;
/// Number of the idle skin's block; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 60;
/// Frames of a trial that differ in noise.
const FRAMES: u64 = 1 << 20;
/// Mean time between false alarms that is accepted, s.
const FALSE_ALARM_S: f64 = 10.0;

/// The samples of a few measurements during a touch, and the threshold that tells a touch from noise.
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
}

/// What the idle skin reads, once a session.
struct Idle {
    /// One value for each row of a frame, V.
    volts: Vec<f64>,
    /// Standard deviation of a sample minus its reference, V.
    sd_v: f64,
}

/// A wire with its parts in one session, while the skin is touched. An entrant requests measurements from it, frame
/// after frame, and has no access to the touch itself.
pub struct WireSession<'a> {
    /// Electronics and clock.
    pub skin: &'a SkinWire,
    /// Profile, which is the same in both modes. Its feedback resistance suits the entrant's sums.
    pub profile: Profile,
    /// Code and level of +1; −1 is code 0, with the level opposite to it.
    plus: (u8, f64),
    /// Relative noise of a contact in this session.
    contact_noise: f64,
    device: Streams,
    faults: Arc<[(usize, Fault)]>,
    held: Held,
    /// Largest sum that was asked for, S.
    largest_sum_s: f64,
    /// Readouts with what they give without a touch, by the rows that they measure.
    frames: BTreeMap<usize, (TouchWire, Idle)>,
}

/// The trial that a session is in.
struct Held {
    /// Conductances with those of the idle skin, S.
    source: Interpolated,
    /// Determines its noise.
    number: u64,
    /// Frames that were measured.
    frame: u64,
    /// Start of the next frame, s.
    clock_s: f64,
    /// Measurements that may still be taken.
    left: usize,
}

impl<'a> WireSession<'a> {
    /// The wire during `trial` from `start_s` on, with at most `most` measurements. `number` determines the noise.
    ///
    /// # Errors
    /// [`Refusal`] for conductances that are none.
    pub fn hold(&mut self, trial: &Trial, number: u64, start_s: f64, most: usize) -> Result<&mut Self, Refusal> {
        if self.held.number != number {
            let idle_s = self.skin.electronics.skin.idle_s;
            let whole = |map: &ConductanceMap| {
                let mut map = map.clone();
                let gains = trial.idle_gains.iter().copied().chain(std::iter::repeat(1.0));
                map.values_mut().iter_mut().zip(gains).for_each(|(g, gain)| *g += gain * idle_s);
                map
            };
            let source = Interpolated::new(trial.times_s.clone(), trial.maps.iter().map(whole).collect())?;
            self.held = Held { source, number, frame: 0, clock_s: start_s, left: most };
        }
        (self.held.clock_s, self.held.left) = (start_s, most);
        Ok(self)
    }

    /// Measurements that may still be taken of this touch.
    pub fn left(&self) -> usize {
        self.held.left
    }

    /// Takes `count` measurements off those that are left.
    pub(super) fn spend(&mut self, count: usize) -> Result<(), Refusal> {
        let left = self.held.left.checked_sub(count);
        let over = || Refusal::new(format!("{count} measurements are asked for; {} are left", self.held.left));
        self.held.left = left.ok_or_else(over)?;
        Ok(())
    }

    /// Threshold for samples of this standard deviation: with Chernoff's bound of a Gaussian's two tails, 2 exp(−z²/2),
    /// no more than one sample in ten seconds lies beyond.
    fn alarm_v(&self, sd_v: f64) -> f64 {
        sd_v * (2.0 * (2.0 * FALSE_ALARM_S / self.skin.period_s).ln()).sqrt()
    }

    /// The samples at the rows `measured` of `rows`, of which there are `all`. `key` names them within the session.
    fn frame<R: CellCodes + Clone + 'static>(
        &mut self,
        key: usize,
        rows: impl Fn() -> R,
        all: usize,
        measured: Range<usize>,
    ) -> Result<WireFrame, Refusal> {
        self.built(key, all, |session| {
            let readout = Readout::new(&session.profile, Mode::Raster, &session.skin.layout, session.device, 0)?;
            readout.with_codes(|_| Ok(Box::new(session.cells(rows()))))
        })?;
        self.measure(key, measured)
    }

    /// Cells that put out `rows`.
    fn cells<R>(&self, rows: R) -> Cells<R> {
        Cells { rows, plus: self.plus.0, faults: Arc::clone(&self.faults) }
    }

    /// Makes the readout with the key `key`, if it is new, and reads the idle skin with it.
    fn built(
        &mut self,
        key: usize,
        all: usize,
        build: impl FnOnce(&Self) -> Result<Readout, Refusal>,
    ) -> Result<(), Refusal> {
        if !self.frames.contains_key(&key) {
            let mut wire = TouchWire::of(build(self)?);
            let idle = self.idle(&mut wire, all)?;
            self.frames.insert(key, (wire, idle));
        }
        Ok(())
    }

    /// The samples at the rows `measured` of the readout with the key `key`.
    fn measure(&mut self, key: usize, measured: Range<usize>) -> Result<WireFrame, Refusal> {
        let alarm_v = self.alarm_v(self.frames.get(&key).map_or(0.0, |(_, idle)| idle.sd_v));
        let Held { source, number, frame, clock_s, .. } = &mut self.held;
        let Some((wire, idle)) = self.frames.get_mut(&key) else { return Err(Refusal::new("no frame")) };
        // the block's time begins with its first row
        let each_s = self.skin.period_s / self.skin.wires.max(1) as f64;
        let before_s = measured.start as f64 * each_s;
        let mut now = source.starting_at(*clock_s - before_s);
        let mut volts = wire.volts_of(&mut now, [*number * FRAMES + *frame, measured.start as u64], measured.len())?;
        (*frame, *clock_s) = (*frame + 1, *clock_s + measured.len() as f64 * each_s);
        volts.iter_mut().zip(&idle.volts[measured]).for_each(|(v, idle)| *v -= idle);
        Ok(WireFrame { volts, alarm_v })
    }

    /// Frames of the idle skin: their mean, and how far single ones are from it.
    fn idle(&self, wire: &mut TouchWire, measurements: usize) -> Result<Idle, Refusal> {
        let frames = IDLE_FRAMES.max(IDLE_MEASUREMENTS.div_ceil(measurements));
        let mut volts = vec![0.0; measurements];
        let mut squares = 0.0;
        let layout = &self.skin.layout;
        let idle_s = vec![self.skin.electronics.skin.idle_s; layout.taxels()];
        let idle = ConductanceMap::from_values(layout.rows(), layout.cols(), idle_s);
        for frame in 0..frames as u64 {
            let frame = wire.volts(idle.clone(), IDLE_BLOCK + frame, measurements)?;
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

    /// A scan of the first `count` taxels: sample k has taxel k at level 1, and all others at 0.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built, or more is asked for than is left.
    pub fn scan(&mut self, count: usize) -> Result<WireFrame, Refusal> {
        self.spend(count)?;
        let taxels = self.skin.layout.taxels();
        self.frame(SCAN, || OneByOne { taxels }, taxels, 0..count)
    }

    /// A frame of `measurements` rows of ±1, as sums of conductances, µS: y = Φ x. Other rows need another `key`.
    ///
    /// # Errors
    /// [`Refusal`] if the rows belong to another skin, or more is asked for than is left.
    pub fn signs<R: CellCodes + Clone + 'static>(
        &mut self,
        key: usize,
        rows: &R,
        measurements: usize,
    ) -> Result<WireFrame, Refusal> {
        self.spend(measurements)?;
        let frame = self.frame(key, || rows.clone(), measurements, 0..measurements)?;
        Ok(self.in_units(frame))
    }

    /// A frame of the first `measurements` rows of `weights` of ±1, which may be those of several wires, as
    /// [`WireSession::signs`] gives it.
    ///
    /// # Errors
    /// As [`WireSession::signs`].
    pub fn given(&mut self, key: usize, weights: &Weights, measurements: usize) -> Result<WireFrame, Refusal> {
        self.spend(measurements)?;
        self.built(key, measurements, |session| {
            let wires = weights.wires().map_or_else(Vec::new, Wires::entries);
            let profile = Profile { weights: CompressiveWeights::Binary, wires, ..session.profile.clone() };
            let readout = Readout::new(&profile, Mode::Compressive, &session.skin.layout, session.device, 0)?;
            readout.with_codes(|own| Ok(Box::new(session.cells(Signs(own.clone())))))
        })?;
        let frame = self.measure(key, 0..measurements)?;
        Ok(self.in_units(frame))
    }

    /// Samples at `rows` of levels in [−1, 1], one level a taxel, as sums of conductances, µS.
    ///
    /// # Errors
    /// As [`WireSession::signs`].
    pub fn levels(&mut self, rows: &[Vec<f64>]) -> Result<Vec<f64>, Refusal> {
        self.spend(rows.len())?;
        // 0 and the opposite of the positive level are codes that there are; others are the nearest
        let code = |level: &f64| match *level {
            0.0 => NEUTRAL,
            1.0 => u8::MAX,
            -1.0 => 0,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in [0, 255]")]
            level => (127.5 + 127.5 * self.plus.1 * level).round().min(254.0) as u8,
        };
        let codes = Patterns::new(rows.len(), rows.iter().flatten().map(code).collect())?;
        let now = self.held.source.at(self.held.clock_s);
        for row in rows {
            let sum: f64 = row.iter().zip(now.values()).map(|(level, g)| level * g).sum();
            self.largest_sum_s = self.largest_sum_s.max(sum.abs());
        }
        // rows that are asked for once
        self.frames.remove(&ONCE);
        let frame = self.frame(ONCE, || codes.clone(), rows.len(), 0..rows.len())?;
        Ok(self.in_units(frame).volts)
    }

    /// Largest magnitude of the sums that [`WireSession::levels`] was asked for, S.
    pub(super) fn largest_sum_s(&self) -> f64 {
        self.largest_sum_s
    }

    /// `frame` as sums of conductances, µS, with weights of ±1.
    fn in_units(&self, mut frame: WireFrame) -> WireFrame {
        let unit_v = UNIT_S * self.profile.volts_per_siemens() * self.plus.1;
        frame.volts.iter_mut().for_each(|v| *v /= unit_v);
        frame.alarm_v /= unit_v;
        frame
    }

    /// Row `row` of the rows of a `group`, of which there are `all`: a sample by itself, and the alarm of the group.
    ///
    /// # Errors
    /// As [`WireSession::signs`].
    pub(super) fn single<R: CellCodes + Clone + 'static>(
        &mut self,
        group: usize,
        rows: impl Fn() -> R,
        all: usize,
        row: usize,
    ) -> Result<(f64, f64), Refusal> {
        self.spend(1)?;
        let frame = self.frame(SINGLE + group, rows, all, row..row + 1)?;
        Ok((frame.volts.first().copied().unwrap_or(0.0), frame.alarm_v))
    }

    /// Each cell's own measurement of its taxel, S: the conductance minus that of the idle skin, with the relative
    /// noise of a contact; 0 of a cell that does not work. It is for cells with a converter of their own; the receiver
    /// at the end of the wire does not know it.
    pub(super) fn own_values_s(&self) -> Vec<f64> {
        let mut rng = self.device.rng("bench/cells", self.number());
        let idle_s = self.skin.electronics.skin.idle_s;
        let noisy = |(taxel, g): (usize, &f64)| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let works = self.faults.iter().all(|(k, fault)| *k != taxel || *fault == Fault::Late);
            if works { (g - idle_s) * (1.0 + self.contact_noise * normal) } else { 0.0 }
        };
        self.held.source.at(self.held.clock_s).values().iter().enumerate().map(noisy).collect()
    }

    fn number(&self) -> u64 {
        self.held.number * FRAMES + self.held.frame
    }

    /// Random numbers for events that are not synchronised with a clock; different for every touch.
    pub(super) fn moments(&self) -> Streams {
        self.device.child("bench/moments", self.number())
    }

    /// Samples while a cell a taxel of `chips` puts out its codes through a resistor of its own with the conductance of
    /// a fully pressed taxel, and all other cells are off. `None` is a silent wire.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built, or more is asked for than is left.
    pub(super) fn transmissions(
        &mut self,
        chips: Option<&Patterns>,
        measurements: usize,
    ) -> Result<WireFrame, Refusal> {
        self.spend(measurements)?;
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
        let mut volts = line(chips)?.volts(map, self.number(), measurements)?;
        volts.iter_mut().for_each(|v| *v -= idle_v);
        self.held.frame += 1;
        self.held.clock_s += measurements as f64 * self.skin.period_s;
        Ok(WireFrame { volts, alarm_v: self.alarm_v(variance.sqrt()) })
    }
}

/// Keys of scans, of rows that are asked for once, and of groups of single rows.
const SCAN: usize = usize::MAX;
const ONCE: usize = usize::MAX - 1;
const SINGLE: usize = usize::MAX / 2;

/// The signs of weights.
#[derive(Clone)]
struct Signs(Weights);

impl CellCodes for Signs {
    fn taxels(&self) -> usize {
        self.0.taxels()
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        let mut levels = vec![0.0; out.len()];
        self.0.fill_rows(first_row, &mut levels);
        out.iter_mut().zip(levels).for_each(|(code, level)| *code = if level > 0.0 { u8::MAX } else { 0 });
        Ok(())
    }
}

/// Cells that put out rows of the codes 0, 255 and neutral, some of which are faulty.
#[derive(Clone)]
struct Cells<R> {
    rows: R,
    /// Code of the level opposite to that of code 0.
    plus: u8,
    faults: Arc<[(usize, Fault)]>,
}

impl<R: CellCodes> CellCodes for Cells<R> {
    fn taxels(&self) -> usize {
        self.rows.taxels()
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        let taxels = self.taxels();
        let mut before = vec![NEUTRAL; taxels];
        if first_row > 0 && !self.faults.is_empty() {
            self.rows.codes(first_row - 1, &mut before)?;
        }
        self.rows.codes(first_row, out)?;
        for codes in out.chunks_exact_mut(taxels) {
            for (taxel, fault) in self.faults.iter() {
                let meant = codes[*taxel];
                codes[*taxel] = match fault {
                    Fault::Dead => NEUTRAL,
                    Fault::Stuck => u8::MAX,
                    Fault::Late => before[*taxel],
                };
                before[*taxel] = meant;
            }
            codes.iter_mut().filter(|code| **code == u8::MAX).for_each(|code| *code = self.plus);
        }
        Ok(())
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
    /// Wires that are measured at once; each has part of the measurements.
    pub wires: usize,
}

impl SkinWire {
    /// The wire of a skin. The feedback is reduced until the sums of the touch `largest_s` (conductances minus the idle
    /// skin's, S) with random signs fit, and the clock is slowed until they settle.
    ///
    /// # Errors
    /// [`Refusal`] if the electronics cannot be built.
    pub fn new(layout: SkinLayout, wires: usize, largest_s: &[f64]) -> Result<Self, Refusal> {
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
            wires,
        })
    }

    /// The wire of `task`, for the largest of its touches to learn from.
    ///
    /// # Errors
    /// As [`SkinWire::new`].
    pub(super) fn of(task: &Task, training: &[Touch]) -> Result<Self, Refusal> {
        let sum = |touch: &Touch| touch.conductance_s.sum();
        let largest = training.iter().max_by(|a, b| sum(a).total_cmp(&sum(b)));
        Self::new(task.layout()?, task.wires, largest.map_or(&[][..], |touch| touch.conductance_s.values()))
    }

    /// Largest magnitude of the sums, S, that `entrant` has with `touches`.
    pub(super) fn largest_sum_s(&self, entrant: &dyn Entrant, touches: &[Touch]) -> f64 {
        let idle_s = self.electronics.skin.idle_s;
        let sums = touches.iter().map(|touch| {
            let whole: Vec<f64> = touch.conductance_s.values().iter().map(|g| g + idle_s).collect();
            entrant.largest_sum_s(&whole)
        });
        sums.fold(0.0, f64::max)
    }

    /// A session of an entrant with the largest sum `largest_sum_s`, S. The feedback is the largest for which the sum
    /// uses 70 % of the range of amplifier and converter, and the output settles within the clock's period. `device`
    /// provides the random numbers; what a session draws is fixed in its profile, the same for all entrants. Some cells
    /// have `faults`.
    ///
    /// # Errors
    /// [`Refusal`] if the amplifier cannot be built, or a profile lacks a value.
    pub fn session(
        &self,
        largest_sum_s: f64,
        device: Streams,
        faults: Arc<[(usize, Fault)]>,
    ) -> Result<WireSession<'_>, Refusal> {
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
            plus: plus(&profile)?,
            profile,
            contact_noise,
            device,
            faults,
            largest_sum_s: 0.0,
            held: Held {
                source: Interpolated::new(vec![0.0], vec![ConductanceMap::zeros(1, 1)])?,
                number: u64::MAX,
                frame: 0,
                clock_s: 0.0,
                left: 0,
            },
            frames: BTreeMap::new(),
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

/// Code of the level opposite to that of code 0, by the data sheet's middle values, and that level. Level of code c is
/// (c + errors − 127.5)/127.5, errors in steps; the output does not go below the floor.
fn plus(profile: &Profile) -> Result<(u8, f64), Refusal> {
    let number = |number: &'static str| match span(profile, "dac", number)? {
        Span::Fixed(value) => Ok(value),
        Span::Between([low, high]) => Ok::<_, Refusal>(0.5 * (low + high)),
    };
    let step_v = number("reference_v")? / 256.0;
    let (offset, gain) = (number("offset_v")? / step_v, number("gain_lsb")?);
    let low = offset.max(number("floor_v")? / step_v) / 127.5 - 1.0;
    let level = |code: u8| (f64::from(code) * (1.0 + gain / 255.0) + offset) / 127.5 - 1.0;
    let nearest = (128..=u8::MAX).min_by(|a, b| (level(*a) + low).abs().total_cmp(&(level(*b) + low).abs()));
    let code = nearest.unwrap_or(u8::MAX);
    Ok((code, 0.5 * (level(code) - low)))
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
        SkinWire::new(SkinLayout::with_pitch(side, side, 15e-3).unwrap(), 1, &touch).unwrap()
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
        let session = |sum_s: f64, seed: u64| wire.session(sum_s, Streams::new(seed), [].into()).unwrap();
        let noise = |sum_s: f64, seed: u64| session(sum_s, seed).contact_noise;
        assert!((noise(1e-3, 1) - noise(1e-2, 1)).abs() < f64::EPSILON);
        assert!((noise(1e-3, 1) - noise(1e-3, 2)).abs() > 1e-6);
        // every session of as_built has a value from this span
        assert!((0.04225..=0.07291).contains(&noise(1e-3, 1)));
        // code 0 has the level 11.797/127.5 − 1 = −0.9075, and code 244 (244 − 1.18)/127.5 − 1 = 0.9045
        let (code, level) = session(1e-3, 1).plus;
        assert!(code == 244 && (level - 0.906).abs() < 1e-3, "{code}: {level}");
    }
}
