//! From estimates to a readout profile.

use super::session::SessionEstimates;
use super::statistics::{Estimate, mean, sd};
use super::steps::Steps;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Counts a second of a cell's millisecond timer: 20 MHz over a prescaler of 64 and 255 counts (tinyAVR core for Arduino).
const CELL_TIMER_HZ: f64 = 20e6 / 64.0 / 255.0;
/// Steps of the rate that the beat's scatter over the cells leaves meaningful, Hz.
const RATE_STEP_HZ: f64 = 100.0;
/// The cells' oscillators are off by this share at room temperature: a rate of the base profile that is nearer is kept.
const OSCILLATOR_SHARE: f64 = 0.01;

/// What recordings of presses cannot tell apart, and why.
pub const NOT_IDENTIFIABLE: [&str; 6] = [
    "Rf and Vd apart: only Rf·Vd·G acts, and G is not known",
    "taxel gains apart from the contact's own pressure, as no object presses evenly: only their change between two sessions of one object",
    "errors of the DAC's codes: binary weights use two of 256, and their mean is the drive offset",
    "the sample rate apart from the cells' oscillators: their beat fixes the ratio, taken as 20 MHz exactly",
    "bits, reference and divider of the converter apart: only the step and the grid act",
    "the raster path: the published scans are cut off at 0; its numbers are kept from the base profile",
];

/// A parameter of the profile: one value a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// Section and key.
    pub name: &'static str,
    /// Value of every session that identifies it.
    pub sessions: Vec<f64>,
    /// Mean over the sessions, or with one session over its presses, and standard error.
    pub estimate: Estimate,
}

/// Parameters of the readout, read off the estimates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Readings {
    /// Compressive parameters, in the order of the profile.
    pub values: Vec<Value>,
    /// Mean beat, measurements, and its standard error over the cells; `None` when no beat is seen.
    pub beat: Option<Estimate>,
    /// Standard deviation of the beat over the cells.
    pub beat_sd: f64,
    /// Measurements a second, Hz; `None` without a beat.
    pub sample_rate_hz: Option<f64>,
    /// Grid of the converter's values.
    pub steps: Option<Steps>,
    /// Lines of the profile for cells that do not run their own sequence.
    faults: String,
    sessions: Vec<String>,
}

/// Digits after the point of volts and shares: the standard errors are a few 1e-4 at best.
const DIGITS: usize = 4;

impl Readings {
    /// Readings of all `sessions` together, or of one.
    #[must_use]
    pub fn of(sessions: &[SessionEstimates]) -> Self {
        let value = |name: &'static str, number: &str, get: &dyn Fn(&SessionEstimates) -> f64| {
            let values: Vec<f64> = sessions.iter().map(get).filter(|v| v.is_finite()).collect();
            let estimate = match sessions {
                [only] => Estimate {
                    mean: values.first().copied().unwrap_or(f64::NAN),
                    ..only.numbers.get(number).copied().unwrap_or(Estimate::of(&[]))
                },
                _ => Estimate::of(&values),
            };
            Value {
                name,
                sessions: values,
                estimate,
            }
        };
        let plain = |name, number: &'static str| value(name, number, &move |s| s.mean(number));
        let periods = periods(sessions);
        let beat = (!periods.is_empty()).then(|| Estimate::of(&periods));
        Self {
            values: vec![
                plain("late_updates.rate", "late_per_flip"),
                plain("drive_offset.constant_v", "idle_mean"),
                plain("drive_offset.asymmetry", "asymmetry"),
                plain("memory.h1", "h1"),
                plain("memory.h2", "h2"),
                plain("clock_pattern.amplitude_v", "parity"),
                plain("contact_noise.fraction", "contact_fraction"),
                value("idle_noise.sd_v", "idle_noise", &idle_noise_v),
            ],
            beat,
            beat_sd: sd(&periods),
            sample_rate_hz: beat.map(|b| (b.mean * CELL_TIMER_HZ / RATE_STEP_HZ).round() * RATE_STEP_HZ),
            steps: sessions.iter().find_map(|s| s.steps),
            // a fault belongs to one session, not to the skin
            faults: if let [only] = sessions {
                faults(only)
            } else {
                String::new()
            },
            sessions: sessions.iter().map(|s| s.session.clone()).collect(),
        }
    }

    /// The profile as TOML; what the recordings do not identify is kept from the TOML table `base`.
    ///
    /// # Errors
    /// The message of a `base` that cannot be written.
    pub fn to_toml(&self, base: &toml::Table) -> Result<String, toml::ser::Error> {
        let mut out = format!(
            "# Readout fitted to recorded presses of {}. Values in [low, high] are drawn once a session (rate: once a taxel).\n\
             # Beside each: mean ± standard error over n {}.\n\n",
            self.sessions.join(", "),
            if self.sessions.len() == 1 {
                "presses"
            } else {
                "sessions"
            }
        );
        let kept = |key: &str| {
            base.get(key)
                .map(|v| format!("{key} = {v}  # kept\n"))
                .unwrap_or_default()
        };
        out.push_str(&kept("weights"));
        out.push_str(&self.rate_line(base));
        out.push_str(&kept("drive_v"));
        out.push_str(&kept("feedback_ohm"));
        let mut section = "";
        for value in &self.values {
            let (effect, key) = value.name.split_once('.').unwrap_or(("", value.name));
            if effect != section {
                let _ = writeln!(out, "\n[compressive.{effect}]");
                section = effect;
            }
            let _ = writeln!(out, "{key} = {}  # {}", span(value), words(&value.estimate));
            if key == "rate" {
                self.push_beat(&mut out, base);
            }
        }
        out.push_str(&self.faults);
        self.push_rest(&mut out, base)?;
        out.push_str("\n# Not identifiable from these recordings:\n");
        for line in NOT_IDENTIFIABLE {
            let _ = writeln!(out, "# - {line}");
        }
        Ok(out)
    }

    /// The rate, from the beat unless that of the base profile agrees with it.
    fn rate_line(&self, base: &toml::Table) -> String {
        let base_hz = base.get("sample_rate_hz").and_then(toml::Value::as_float);
        match (self.sample_rate_hz, self.beat, base_hz) {
            (Some(rate_hz), Some(beat), Some(base_hz)) if (rate_hz / base_hz - 1.0).abs() <= OSCILLATOR_SHARE => {
                format!(
                    "sample_rate_hz = {base_hz:?}  # kept: the beat says {rate_hz} ± {:.0} Hz for cells of 20 MHz exactly\n",
                    beat.standard_error * CELL_TIMER_HZ
                )
            }
            (Some(rate_hz), Some(beat), _) => format!(
                "sample_rate_hz = {rate_hz:?}  # ± {:.0} Hz: beat of {:.2} measurements × {CELL_TIMER_HZ:.1} Hz\n",
                beat.standard_error * CELL_TIMER_HZ,
                beat.mean
            ),
            (_, _, base_hz) => base_hz
                .map(|v| format!("sample_rate_hz = {v:?}  # kept: no beat seen\n"))
                .unwrap_or_default(),
        }
    }

    fn push_beat(&self, out: &mut String, base: &toml::Table) {
        if let Some(beat) = self.beat {
            let _ = writeln!(
                out,
                "period_measurements = {:.2}  # {}\nperiod_sd_measurements = {:.2}",
                beat.mean,
                format_args!("± {:.2}, {} beats of cells", beat.standard_error, beat.n),
                self.beat_sd.min(0.1 * beat.mean)
            );
            return;
        }
        for key in ["period_measurements", "period_sd_measurements"] {
            let kept = base
                .get("compressive")
                .and_then(|c| c.get("late_updates"))
                .and_then(|l| l.get(key));
            if let Some(kept) = kept {
                let _ = writeln!(out, "{key} = {kept}  # kept: no beat seen");
            }
        }
    }

    /// Effects of the base profile that the recordings say nothing about.
    fn push_rest(&self, out: &mut String, base: &toml::Table) -> Result<(), toml::ser::Error> {
        let fitted = |name: &str| self.values.iter().any(|v| v.name.split('.').next() == Some(name));
        let mut rest = toml::Table::new();
        for mode in ["compressive", "raster"] {
            let Some(toml::Value::Table(effects)) = base.get(mode) else {
                continue;
            };
            let kept = effects.iter().filter(|(name, _)| mode == "raster" || !fitted(name));
            let kept: toml::Table = kept.map(|(k, v)| (k.clone(), v.clone())).collect();
            rest.insert(mode.to_owned(), toml::Value::Table(kept));
        }
        if let Some(steps) = self.steps
            && let Some(adc) = rest.get_mut("compressive").and_then(|c| c.get_mut("adc"))
        {
            let _ = writeln!(out, "\n# Fitted: the converter's step is {:.4} mV", 1e3 * steps.step_v);
            on_grid(adc, steps);
        }
        let _ = write!(out, "\n# Kept from the base profile:\n\n{}", toml::to_string(&rest)?);
        Ok(())
    }
}

/// A step that agrees with the base converter's to this share is the same.
const SAME_STEP: f64 = 1e-6;

/// Gives the converter `adc` the divider and offset that put its values on the grid `steps`, unless they are on it.
fn on_grid(adc: &mut toml::Value, steps: Steps) {
    let number = |key: &str| {
        adc.get(key)
            .and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)))
    };
    let (Some(bits), Some(reference_v), Some(divider), Some(offset_v)) = (
        number("bits"),
        number("reference_v"),
        number("divider"),
        number("offset_v"),
    ) else {
        return;
    };
    let fitted = steps.step_v * (bits.exp2() - 1.0) / reference_v;
    if (fitted / divider - 1.0).abs() <= SAME_STEP {
        return;
    }
    let codes = ((offset_v - steps.origin_v) / steps.step_v).round();
    adc["divider"] = fitted.into();
    adc["offset_v"] = (steps.origin_v + codes * steps.step_v).into();
}

/// Beat of every cell that one was seen of, measurements: the mean over the sessions.
fn periods(sessions: &[SessionEstimates]) -> Vec<f64> {
    let mut cells: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for beat in sessions.iter().flat_map(|s| &s.beats) {
        cells.entry(beat.taxel).or_default().push(beat.period_measurements);
    }
    cells.into_values().map(|of_cell| mean(&of_cell)).collect()
}

/// Noise floor before the converter, whose rounding adds step²/12.
fn idle_noise_v(s: &SessionEstimates) -> f64 {
    let step_v = s.steps.map_or(0.0, |s| s.step_v);
    (s.mean("idle_noise").powi(2) - step_v.powi(2) / 12.0).max(0.0).sqrt()
}

/// `value`, or `[low, high]` over the sessions.
fn span(value: &Value) -> String {
    let low = value.sessions.iter().copied().fold(f64::INFINITY, f64::min);
    let high = value.sessions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match value.sessions[..] {
        [] => "0.0".to_owned(),
        [only] => format!("{only:.DIGITS$}"),
        _ => format!("[{low:.DIGITS$}, {high:.DIGITS$}]"),
    }
}

fn words(e: &Estimate) -> String {
    if e.n == 0 {
        return "not identified: no press says anything about it".to_owned();
    }
    if e.n == 1 {
        return format!("{:.DIGITS$}, n = 1: no uncertainty", e.mean);
    }
    format!("{:.DIGITS$} ± {:.DIGITS$}, n = {}", e.mean, e.standard_error, e.n)
}

fn faults(session: &SessionEstimates) -> String {
    let mut out = String::new();
    for cell in &session.overdriven {
        let _ = writeln!(
            out,
            "\n[[faults]]\nname = \"overdriven\"\ntaxel = {}\nseed = {}\ngain = {:.3}\ncarry = {:.3}\nbias = {:.3}",
            cell.taxel, cell.seed, cell.gain, cell.carry, cell.bias
        );
    }
    let binary = super::faults::reseeded(&session.faults);
    let binary = binary
        .iter()
        .filter(|b| session.overdriven.iter().all(|o| o.taxel != b.taxel));
    for cell in binary {
        let _ = writeln!(
            out,
            "\n[[faults]]\nname = \"mis_seeded\"\ntaxel = {}\nseed = {}",
            cell.taxel, cell.seed
        );
    }
    out
}
