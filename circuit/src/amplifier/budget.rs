//! Error budget of a summing amplifier for a skin, a clock and a converter, and ways to read larger skins: a smaller
//! feedback, a tree of amplifiers, or more wires.

use super::parts::{Amplifier, Network};
use super::response::{AmplifierNoise, AmplifierResponse};
use crate::converter::Adc;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::{in_range, within};

/// Excursion of the sum that has to fit, in standard deviations: the sum of many taxels with random signs is Gaussian,
/// and 6 of 100 000 measurements lie beyond four.
pub(super) const EXCURSION_SD: f64 = 4.0;

/// How a skin is pressed, as far as the amplifier is concerned. It holds for any number of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Skin {
    /// Share of taxels that are pressed, spread evenly over the amplifiers if there are several. Range [0, 1].
    pub pressed_share: f64,
    /// Conductance of a pressed taxel, S. Range [0, 1].
    pub pressed_s: f64,
    /// Conductance of an idle taxel, S. Range [0, 1].
    pub idle_s: f64,
    /// Drive Vd at level 1, V. Range [1e-3, 1e3].
    pub drive_v: f64,
}

/// 25 % at 150 µS (6.7 kΩ, some 20 kPa on Velostat between electrodes of 1 cm²), the others at 1 µS, driven with the
/// published ± 3.3 V.
impl Default for Skin {
    fn default() -> Self {
        Self { pressed_share: 0.25, pressed_s: 150e-6, idle_s: 1e-6, drive_v: 3.3 }
    }
}

impl Skin {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// [`Refusal`] that names the value outside its range.
    pub fn validate(&self) -> Result<(), Refusal> {
        within("pressed_share", self.pressed_share, 0.0, 1.0, "[0, 1]")?;
        within("pressed_s", self.pressed_s, 0.0, 1.0, "[0, 1]")?;
        within("idle_s", self.idle_s, 0.0, 1.0, "[0, 1]")?;
        within("drive_v", self.drive_v, 1e-3, 1e3, "[1e-3, 1e3]")
    }

    /// Mean over the taxels of a function of their conductance.
    fn mean(&self, f: fn(f64) -> f64) -> f64 {
        self.pressed_share * f(self.pressed_s) + (1.0 - self.pressed_share) * f(self.idle_s)
    }

    /// ΣG of `taxels` taxels, S.
    pub fn conductance_s(&self, taxels: f64) -> f64 {
        taxels * self.mean(|g| g)
    }

    /// Standard deviation of ΣGk·Vk under random signs of the drives, A: Vd √(ΣG²).
    fn current_rms_a(&self, taxels: f64) -> f64 {
        self.drive_v * (taxels * self.mean(|g| g * g)).sqrt()
    }

    /// Largest ΣGk·Vk there can be, A: all signs alike.
    fn current_worst_a(&self, taxels: f64) -> f64 {
        self.drive_v * self.conductance_s(taxels)
    }
}

/// What the amplifier has to cope with: how the skin is pressed, the converter behind it, and the time between a change
/// of the drives and the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The pressed skin.
    pub skin: Skin,
    /// The converter after the last amplifier.
    pub adc: Adc,
    /// Time from the change of the drives to the sampling of the output, s.
    pub available_s: f64,
}

/// Why a readout does not work at a given size of the skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// When the output is sampled, it has not yet settled to half a step of the converter.
    Settling,
    /// The sum exceeds the amplifier's rails.
    Rails,
    /// The sum exceeds the converter's range.
    ConverterRange,
    /// The feedback needs more current than the amplifier can deliver.
    OutputCurrent,
    /// A taxel's signal is less than one step of the converter.
    ConverterStep,
}

impl Limit {
    /// The limit in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Settling => "settling",
            Self::Rails => "rails",
            Self::ConverterRange => "converter's range",
            Self::OutputCurrent => "output current",
            Self::ConverterStep => "converter's step",
        }
    }
}

/// A limit, and the quantity over what it may be: above 1 it fails.
pub(super) type Strain = (Limit, f64);

/// The limit that fails by the largest factor, the first of equal ones; `None` when none fails.
pub(super) fn worst(loads: impl IntoIterator<Item = Strain>) -> Option<Limit> {
    let failing = loads.into_iter().filter(|(_, share)| *share > 1.0);
    let worse = |a: Strain, b: Strain| if b.1 > a.1 { b } else { a };
    failing.reduce(worse).map(|(limit, _)| limit)
}

/// Error budget of one amplifier with one wire and one converter. All voltages are at its output.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Budget {
    /// 1 + Rf·ΣG.
    pub noise_gain: f64,
    /// Frequency at which the response is down by 3 dB, Hz.
    pub bandwidth_hz: f64,
    /// Quality factor of the response. Above ½ the output rings after a step.
    pub quality: f64,
    /// Time for a step over the whole range to settle within half a step of the converter, s; without slewing.
    pub settle_s: f64,
    /// Longest time that the slew rate adds, s: that of a change of the output by twice `excursion_v`.
    pub slew_s: f64,
    /// Noise by source, V rms.
    pub noise_v: AmplifierNoise,
    /// Root sum of squares of all sources, V rms; without the converter.
    pub noise_v_rms: f64,
    /// Step of the converter, V.
    pub adc_step_v: f64,
    /// Quantisation noise of the converter, V rms: step/√12.
    pub adc_noise_v: f64,
    /// Signal of one pressed taxel, V: Rf·Vd·G.
    pub signal_v: f64,
    /// Signal of one pressed taxel relative to the amplifier's noise, dB.
    pub snr_db: f64,
    /// `snr_db` with the quantisation noise of the converter included.
    pub snr_adc_db: f64,
    /// Standard deviation of the sum of all taxels under random signs, V.
    pub sum_rms_v: f64,
    /// Sum if all signs are equal, V.
    pub sum_worst_v: f64,
    /// Sum that has to fit, V: four standard deviations, or `sum_worst_v` if that is less.
    pub excursion_v: f64,
    /// Largest output within the ranges of amplifier and converter, V.
    pub range_v: f64,
    /// Whether `excursion_v` exceeds `range_v`.
    pub saturates: bool,
    /// The limit that is exceeded by the largest factor, if any is exceeded; see [`Limit`].
    pub limit: Option<Limit>,
}

impl Budget {
    /// The budget of `amplifier` with `taxels` taxels.
    pub fn new(amplifier: &Amplifier, taxels: f64, setting: &Setting) -> Self {
        let Setting { skin, adc, available_s } = setting;
        let conductance_s = skin.conductance_s(taxels);
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let noise_v = AmplifierNoise::rms(amplifier, conductance_s);
        let feedback_ohm = amplifier.network().feedback_ohm;
        let [sum_rms_v, sum_worst_v] =
            [skin.current_rms_a(taxels), skin.current_worst_a(taxels)].map(|current_a| feedback_ohm * current_a);
        let excursion_v = (EXCURSION_SD * sum_rms_v).min(sum_worst_v);
        let op_amp = amplifier.op_amp();
        let ends_v = adc_ends_v(adc);
        let settle_s = response.settle_s(settling_fraction(adc));
        let slew_s = 2.0 * excursion_v.min(op_amp.rail_v) / op_amp.slew_v_per_s;
        let signal_v = feedback_ohm * skin.drive_v * skin.pressed_s;
        let adc_noise_v = adc.lsb_v() / 12_f64.sqrt();
        let noise_v_rms = noise_v.total();
        let strains = [
            (Limit::Settling, (settle_s + slew_s) / available_s),
            (Limit::Rails, excursion_v / op_amp.rail_v),
            (Limit::ConverterRange, excursion_v / ends_v),
            (Limit::OutputCurrent, excursion_v.min(op_amp.rail_v) / feedback_ohm / op_amp.output_a),
            (Limit::ConverterStep, adc.lsb_v() / signal_v),
        ];
        Self {
            noise_gain: response.noise_gain(),
            bandwidth_hz: response.bandwidth_hz(),
            quality: response.quality(),
            settle_s,
            slew_s,
            noise_v,
            noise_v_rms,
            adc_step_v: adc.lsb_v(),
            adc_noise_v,
            signal_v,
            snr_db: decibels(signal_v, noise_v_rms),
            snr_adc_db: decibels(signal_v, noise_v_rms.hypot(adc_noise_v)),
            sum_rms_v,
            sum_worst_v,
            excursion_v,
            range_v: op_amp.rail_v.min(ends_v),
            saturates: excursion_v > op_amp.rail_v.min(ends_v),
            limit: worst(strains),
        }
    }
}

/// 20 log₁₀ of a ratio of amplitudes; finite also for a signal or a noise of nothing.
pub(super) fn decibels(signal_v: f64, noise_v: f64) -> f64 {
    20.0 * (signal_v.max(f64::MIN_POSITIVE) / noise_v.max(f64::MIN_POSITIVE)).log10()
}

/// The nearer end of the converter's range, V from 0.
pub(super) fn adc_ends_v(adc: &Adc) -> f64 {
    let [top, bottom] = [f64::MAX, f64::MIN].map(|v| adc.volts(adc.code(v)));
    top.min(-bottom).max(0.0)
}

/// Half a step over the whole range.
pub(super) fn settling_fraction(adc: &Adc) -> f64 {
    let [top, bottom] = [f64::MAX, f64::MIN].map(|v| adc.volts(adc.code(v)));
    0.5 * adc.lsb_v() / (top - bottom)
}

/// Taxels of the skin as built, for which the feedback was chosen.
const TAXELS_AS_BUILT: f64 = 100.0;

/// A change of the readout by which one amplifier design serves a skin of more taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// One amplifier with unchanged feedback.
    AsBuilt,
    /// One amplifier whose feedback is divided by (number of taxels)/100. The largest sum, the noise gain and, without
    /// capacitance on the bus, the bandwidth stay the same. The signal of a taxel falls as 100/N, and the rms of the
    /// sum as √(100/N).
    FeedbackScaled,
    /// One amplifier for every 100 taxels or fewer, and further levels of amplifiers that each sum up to 100 outputs.
    /// Each level has the largest gain ≤ 1 with which its sum fits. There is one wire and one converter at the end.
    SubArrays,
    /// As many wires as necessary, read at the same time, each with an unchanged amplifier and its own converter.
    /// Taxels are divided evenly; the budget is that of a wire with the most taxels.
    Wires,
}

impl Remedy {
    /// Every remedy, the unchanged circuit first.
    pub const ALL: [Self; 4] = [Self::AsBuilt, Self::FeedbackScaled, Self::SubArrays, Self::Wires];

    /// The remedy in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::AsBuilt => "one wire, as built",
            Self::FeedbackScaled => "feedback scaled",
            Self::SubArrays => "sub-arrays",
            Self::Wires => "more wires",
        }
    }
}

/// A skin of some size read with one of the remedies: its parts, and whether it works.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Remedied {
    /// Taxels of the whole skin.
    pub taxels: u32,
    /// The remedy.
    pub remedy: Remedy,
    /// Number of wires, each with its converter.
    pub wires: u32,
    /// Number of amplifiers.
    pub amplifiers: u32,
    /// Number of levels of amplifiers between a taxel and its converter.
    pub levels: u32,
    /// Feedback resistance of the first level, Ω.
    pub feedback_ohm: f64,
    /// Gain from the first level's output to the converter's input.
    pub gain: f64,
    /// Budget of one wire. With several levels it holds the largest noise gain, the smallest bandwidth, the sum of the
    /// settling times (an upper bound), the longest slewing time (levels slew at the same time), and the total noise at
    /// the last output.
    #[serde(flatten)]
    pub budget: Budget,
}

/// Budget of `taxels` taxels read with the parts `amplifier`. For [`Remedy::SubArrays`], every amplifier has
/// `sub_array` ≥ 2 inputs.
///
/// ```
/// use spts_circuit::amplifier::{Amplifier, Network, OpAmp, Remedy, Setting, Skin, remedied};
///
/// let adc = toml::from_str("bits = 10\nreference_v = 3.3\ndivider = 6.67\noffset_v = 11.0")?;
/// let skin = Skin { pressed_share: 0.1, pressed_s: 1e-4, idle_s: 0.0, drive_v: 4.3 };
/// let setting = Setting { skin, adc, available_s: 12e-6 };
/// let amplifier = Amplifier::new(OpAmp::default(), Network::default())?;
/// let one = remedied(&amplifier, 10_000, 100, Remedy::AsBuilt, &setting)?;
/// let tree = remedied(&amplifier, 10_000, 100, Remedy::SubArrays, &setting)?;
/// assert!(one.budget.limit.is_some(), "10,000 taxels are too many for one amplifier");
/// assert!(tree.amplifiers > 100 && tree.wires == 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Refusal`] for zero taxels, a sub-array of fewer than 2 inputs, or a scaled feedback below its range.
pub fn remedied(
    amplifier: &Amplifier,
    taxels: u32,
    sub_array: u32,
    remedy: Remedy,
    setting: &Setting,
) -> Result<Remedied, Refusal> {
    in_range("taxels", f64::from(taxels), taxels > 0, "[1, 4294967295]")?;
    in_range("sub_array", f64::from(sub_array), sub_array > 1, "[2, 4294967295]")?;
    setting.skin.validate()?;
    match remedy {
        Remedy::AsBuilt => Ok(wired(amplifier, taxels, 1, remedy, setting)),
        Remedy::FeedbackScaled => {
            let feedback_ohm = amplifier.network().feedback_ohm * TAXELS_AS_BUILT / f64::from(taxels);
            let scaled = with_feedback(amplifier, feedback_ohm)?;
            Ok(wired(&scaled, taxels, 1, remedy, setting))
        }
        Remedy::Wires => fewest_wires(taxels, setting, &|_| Ok(*amplifier)),
        Remedy::SubArrays => sub_arrays(amplifier, taxels, sub_array, setting),
    }
}

fn with_feedback(amplifier: &Amplifier, feedback_ohm: f64) -> Result<Amplifier, Refusal> {
    let network = Network { feedback_ohm, ..*amplifier.network() };
    Amplifier::new(*amplifier.op_amp(), network)
}

/// `taxels` taxels on `wires` wires, an `amplifier` on each; the fullest wire is the one that is described.
fn wired(amplifier: &Amplifier, taxels: u32, wires: u32, remedy: Remedy, setting: &Setting) -> Remedied {
    Remedied {
        taxels,
        remedy,
        wires,
        amplifiers: wires,
        levels: 1,
        feedback_ohm: amplifier.network().feedback_ohm,
        gain: 1.0,
        budget: Budget::new(amplifier, f64::from(taxels.div_ceil(wires)), setting),
    }
}

/// Smallest number of wires with which nothing fails. `on_bus(n)` is the amplifier of a bus of n taxels. The result is
/// one wire a taxel if something fails for every number.
///
/// More taxels on a wire are not always worse: with a capacitance on the bus, their conductance damps the ringing.
/// Every number of wires w is therefore considered. The outcome depends only on the fullest and the emptiest wire, with
/// ⌈N/w⌉ and ⌊N/w⌋ taxels; there are fewer than 4√N such pairs.
///
/// # Errors
/// As [`remedied`], and the errors of `on_bus`.
pub fn fewest_wires(
    taxels: u32,
    setting: &Setting,
    on_bus: &dyn Fn(u32) -> Result<Amplifier, Refusal>,
) -> Result<Remedied, Refusal> {
    in_range("taxels", f64::from(taxels), taxels > 0, "[1, 4294967295]")?;
    setting.skin.validate()?;
    let works =
        |n: u32| -> Result<bool, Refusal> { Ok(Budget::new(&on_bus(n)?, f64::from(n), setting).limit.is_none()) };
    let mut wires = 1;
    while wires < taxels {
        let (fewest, most) = (taxels / wires, taxels.div_ceil(wires));
        if works(most)? && (fewest == most || works(fewest)?) {
            break;
        }
        // all numbers of wires up to `last` leave as many on the emptiest; only `last` itself can leave no more on the
        // fullest
        let last = taxels / fewest;
        wires = if last > wires && last * fewest == taxels { last } else { last + 1 };
    }
    Ok(wired(&on_bus(taxels.div_ceil(wires))?, taxels, wires, Remedy::Wires, setting))
}

/// A tree of amplifiers. Inputs of the upper levels are resistors of Rf/gain to a feedback of Rf.
fn sub_arrays(amplifier: &Amplifier, taxels: u32, sub_array: u32, setting: &Setting) -> Result<Remedied, Refusal> {
    let mut count = taxels.div_ceil(sub_array);
    let budget = Budget::new(amplifier, f64::from(taxels) / f64::from(count), setting);
    let (op_amp, feedback_ohm) = (amplifier.op_amp(), amplifier.network().feedback_ohm);
    let held_v = budget.excursion_v.min(op_amp.rail_v);
    let mut tree = Tree {
        first: [
            (Limit::Rails, budget.excursion_v / op_amp.rail_v),
            (Limit::OutputCurrent, held_v / feedback_ohm / op_amp.output_a),
        ],
        total: Remedied {
            taxels,
            remedy: Remedy::SubArrays,
            wires: 1,
            amplifiers: count,
            levels: 1,
            feedback_ohm,
            gain: 1.0,
            budget,
        },
    };
    // noise of all amplifiers of the level, at the sum of their outputs: equal and independent
    tree.scale_noise(f64::from(count).sqrt());
    // no bus of taxels at the upper levels, and so none of its capacitance
    let upper = Amplifier::new(*amplifier.op_amp(), Network { bus_f: 0.0, ..*amplifier.network() })?;
    while count > 1 {
        let inputs = count;
        count = inputs.div_ceil(sub_array);
        tree.add(&upper, inputs, count, setting);
    }
    Ok(tree.finish(amplifier, setting))
}

/// A tree under construction.
struct Tree {
    /// Result over the levels so far; voltages are at the sum of the last level's outputs.
    total: Remedied,
    /// Rails and output current, for the first level only.
    first: [Strain; 2],
}

impl Tree {
    fn scale_noise(&mut self, factor: f64) {
        let n = &mut self.total.budget.noise_v;
        for v in [&mut n.taxels, &mut n.feedback, &mut n.voltage, &mut n.current] {
            *v *= factor;
        }
    }

    /// A level of `count` amplifiers over `inputs` outputs of the level before.
    fn add(&mut self, amplifier: &Amplifier, inputs: u32, count: u32, setting: &Setting) {
        let (inputs, count) = (f64::from(inputs), f64::from(count));
        let fan_in = inputs / count;
        let b = &mut self.total.budget;
        // the sum with a gain of 1: independent signs add as squares, like ones as they are
        let (rms_v, worst_v) = (b.sum_rms_v * fan_in.sqrt(), b.sum_worst_v * fan_in);
        let excursion_v = (EXCURSION_SD * rms_v).min(worst_v);
        let gain = if excursion_v > b.range_v { b.range_v / excursion_v } else { 1.0 };
        let feedback_ohm = amplifier.network().feedback_ohm;
        let conductance_s = fan_in * gain / feedback_ohm;
        let response = AmplifierResponse::new(amplifier, conductance_s);
        let noise = AmplifierNoise::rms(amplifier, conductance_s);
        b.noise_gain = b.noise_gain.max(response.noise_gain());
        b.bandwidth_hz = b.bandwidth_hz.min(response.bandwidth_hz());
        b.quality = b.quality.max(response.quality());
        b.settle_s += response.settle_s(settling_fraction(&setting.adc));
        (b.sum_rms_v, b.sum_worst_v, b.excursion_v) = (gain * rms_v, gain * worst_v, gain * excursion_v);
        b.slew_s = b.slew_s.max(2.0 * b.excursion_v / amplifier.op_amp().slew_v_per_s);
        b.signal_v *= gain;
        self.scale_noise(gain);
        let n = &mut self.total.budget.noise_v;
        let own = |so_far: f64, of_one: f64| so_far.hypot(of_one * count.sqrt());
        n.feedback = own(n.feedback, noise.feedback.hypot(noise.taxels));
        n.voltage = own(n.voltage, noise.voltage);
        n.current = own(n.current, noise.current);
        self.total.levels += 1;
        #[expect(clippy::cast_possible_truncation, reason = "a count that came from an integer")]
        let added = count as u32;
        self.total.amplifiers += added;
        self.total.gain *= gain;
    }

    /// What follows from the sums.
    fn finish(mut self, amplifier: &Amplifier, setting: &Setting) -> Remedied {
        let b = &mut self.total.budget;
        b.noise_v_rms = b.noise_v.total();
        b.snr_db = decibels(b.signal_v, b.noise_v_rms);
        b.snr_adc_db = decibels(b.signal_v, b.noise_v_rms.hypot(b.adc_noise_v));
        let op_amp = amplifier.op_amp();
        // a gain below 1 brings the sum to the range itself, to rounding
        let filled = b.excursion_v / (b.range_v * (1.0 + 1e-12));
        let [rails, current] = self.first;
        b.saturates = rails.1 > 1.0 || filled > 1.0;
        let range = if op_amp.rail_v <= adc_ends_v(&setting.adc) { Limit::Rails } else { Limit::ConverterRange };
        let last_a = b.excursion_v.min(op_amp.rail_v) / amplifier.network().feedback_ohm;
        b.limit = worst([
            (Limit::Settling, (b.settle_s + b.slew_s) / setting.available_s),
            rails,
            current,
            (range, filled),
            (Limit::OutputCurrent, last_a / op_amp.output_a),
            (Limit::ConverterStep, b.adc_step_v / b.signal_v),
        ]);
        self.total
    }
}
