//! Error budget of one summing amplifier for a skin, a clock and a converter.

use super::noise::AmplifierNoise;
use super::parts::Amplifier;
use super::response::AmplifierResponse;
use crate::effects::Adc;
use serde::{Deserialize, Serialize};
use spts_models::{ConfigError, within};

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
        Self {
            pressed_share: 0.25,
            pressed_s: 150e-6,
            idle_s: 1e-6,
            drive_v: 3.3,
        }
    }
}

impl Skin {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// [`ConfigError`] that names the value outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
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
    #[must_use]
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
    #[must_use]
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
    #[must_use]
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
            (
                Limit::OutputCurrent,
                excursion_v.min(op_amp.rail_v) / feedback_ohm / op_amp.output_a,
            ),
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
