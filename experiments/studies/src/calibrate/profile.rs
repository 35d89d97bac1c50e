//! Turns estimates into a readout profile.

use super::SessionEstimates;
use super::cells::Overdriven;
use super::predict::{COVERAGE, PredictedInside, clipped, leave_one_out, predicted};
use super::statistics::{ConverterSteps, Estimated, mean, sd};
use super::windows::Reseeded;
use crate::wiring::shipped;
use serde::Serialize;
use spts::chain::DEFAULT_READOUT;
use spts_circuit::{LevelSource, Profile, Seeding, Weights};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Counts a second of a cell's millisecond timer: 20 MHz over a prescaler of 64 and 255 counts (tinyAVR core for
/// Arduino).
const CELL_TIMER_HZ: f64 = 20e6 / 64.0 / 255.0;
/// Steps of the rate that the beat's scatter over the cells leaves meaningful, Hz.
const RATE_STEP_HZ: f64 = 100.0;
/// The cells' oscillators are off by this share at room temperature: a rate of the recordings that is nearer is kept.
const OSCILLATOR_SHARE: f64 = 0.01;

/// Parameters that recordings of presses cannot distinguish, and why.
pub const NOT_IDENTIFIABLE: [&str; 6] = [
    "Rf and Vd apart: only Rf·Vd·G acts, and G is not known",
    "taxel gains apart from the contact's own pressure, as no object presses evenly: only their change between two sessions of one object",
    "errors of the DAC's codes: binary weights use two of 256, and their mean is the drive offset",
    "the sample rate apart from the cells' oscillators: their beat fixes the ratio, taken as 20 MHz exactly",
    "bits, reference and divider of the converter apart: only the step and the grid act",
    "the raster path: nothing is fitted to raster sessions; [raster.*] is kept from the base profile",
];

/// Effects in the recordings that the readout does not model.
pub const NOT_MODELLED: [&str; 2] = [
    "the even/odd pattern with nothing on the skin (idle_parity, up to 0.12 V) where it differs from that in contact (parity): the \
     profile has one, that in contact; idle_noise is without it, idle_sd with it",
    "outliers that no late update explains (unexplained_outliers): the twin has none of them; where a contact does not let them be told \
     from late updates, they are taken for these",
];

/// The readout as fitted to all sessions: what `spts calibrate` writes as a readout profile.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedReadout {
    /// Compressive parameters, in order of the profile.
    pub values: Vec<FittedParameter>,
    /// Mean beat period, measurements, and its standard error over the cells; `None` if no beat is found.
    pub beat: Option<Estimated>,
    /// Standard deviation of the beat period over the cells.
    pub beat_sd: f64,
    /// Measurements a second, Hz; `None` without a beat.
    pub sample_rate_hz: Option<f64>,
    /// Grid of the converter's values.
    pub steps: Option<ConverterSteps>,
    /// Profile text for cells that do not run their own sequence.
    faults: String,
    sessions: Vec<String>,
    /// Weights of the recordings.
    #[serde(skip)]
    weights: Option<Weights>,
    /// Measurements a second stated in the recordings, Hz.
    #[serde(skip)]
    recorded_hz: Option<f64>,
}

/// Significant digits of a value: the standard errors are a few percent.
const DIGITS: i32 = 4;
/// Significant digits of a standard error.
const ERROR_DIGITS: i32 = 2;

impl FittedReadout {
    /// Fits the readout to all `sessions` together, or to one. They must have the same weights and rate.
    pub fn of(sessions: &[SessionEstimates]) -> Self {
        let periods = periods(sessions);
        let beat = (!periods.is_empty()).then(|| Estimated::mean_of(&periods));
        Self {
            values: PARAMETERS.iter().map(|parameter| fitted(parameter, sessions)).collect(),
            beat,
            beat_sd: sd(&periods),
            sample_rate_hz: beat.map(|b| (b.value * CELL_TIMER_HZ / RATE_STEP_HZ).round() * RATE_STEP_HZ),
            steps: sessions.iter().find_map(|s| s.steps),
            faults: fault_lines(sessions),
            sessions: sessions.iter().map(|s| s.session.clone()).collect(),
            weights: sessions.first().map(|s| s.weights.clone()),
            recorded_hz: sessions.first().map(|s| s.sample_rate_hz),
        }
    }

    /// The profile as TOML. Parameters that the recordings do not determine are taken from the TOML table `base`.
    fn to_toml(&self, base: &toml::Table) -> Result<String, toml::ser::Error> {
        let mut out = self.header();
        let kept = |key: &str| base.get(key).map(|v| format!("{key} = {v}  # kept\n")).unwrap_or_default();
        let weights = self.weights_lines(base)?;
        out.push_str(&weights.unwrap_or_else(|| kept("weights")));
        out.push_str(&self.rate_line(base));
        out.push_str(&kept("drive_v"));
        out.push_str(&kept("feedback_ohm"));
        let kept = |effect: &str, key: &str| base.get("compressive")?.get(effect)?.get(key);
        let mut line = |text: String| out.push_str(&(text + "\n"));
        let mut section = "";
        for value in &self.values {
            let (effect, key) = value.name.split_once('.').unwrap_or(("", value.name));
            if effect != section {
                line(format!("\n[compressive.{effect}]"));
                section = effect;
            }
            if let Some(span) = value.span {
                line(format!("{key} = {}  # {}", span_text(span), words(&value.estimate)));
            } else if let Some(kept) = kept(effect, key) {
                line(format!("{key} = {kept}  # kept: not identified, no press says anything about it"));
            }
            match self.beat {
                _ if key != "rate" => {}
                Some(beat) => {
                    let (period, error) = (beat.value, error_text(beat, 1.0, 2));
                    let sd = self.beat_sd.min(0.1 * period);
                    line(format!("period_measurements = {period:.2}  # mean{error}, {} beats of cells", beat.n));
                    line(format!("period_sd_measurements = {sd:.2}"));
                }
                None => {
                    for key in ["period_measurements", "period_sd_measurements"] {
                        if let Some(kept) = kept(effect, key) {
                            line(format!("{key} = {kept}  # kept: no beat seen"));
                        }
                    }
                }
            }
        }
        out.push_str(&self.faults);
        self.push_rest(&mut out, base)?;
        for (title, lines) in [
            ("Not identifiable from these recordings", NOT_IDENTIFIABLE.as_slice()),
            ("In the recordings, not modelled", NOT_MODELLED.as_slice()),
        ] {
            let _ = write!(out, "\n# {title}:\n# - {}\n", lines.join("\n# - "));
        }
        Ok(out)
    }

    /// What the numbers are, as comments.
    fn header(&self) -> String {
        let names = self.sessions.join(", ");
        if self.sessions.len() == 1 {
            return format!(
                "# Readout fitted to recorded presses of {names}.\n\
                 # Beside each value: median ± standard error over n presses.\n\n"
            );
        }
        format!(
            "# Readout fitted to recorded presses of {names}.\n\
             # [low, high] predicts: a new session's value falls inside with a probability of {:.0} %. It is mean ± t·s·√(1 + 1/n)\n\
             # over n sessions, t the two-sided quantile of Student's distribution of n − 1 degrees of freedom, cut off where a readout\n\
             # ends (rates, fractions and noise are not below 0). A value is drawn from it uniformly, once a session. The span of `rate`\n\
             # is the spread over the taxels, and is drawn from once a taxel.\n\
             # Beside each: mean ± standard error over n sessions, each with the median over its presses.\n\n",
            100.0 * COVERAGE
        )
    }

    /// Weights of the recordings; `None` when they are those of the base profile.
    fn weights_lines(&self, base: &toml::Table) -> Result<Option<String>, toml::ser::Error> {
        let Some(weights) = &self.weights else {
            return Ok(None);
        };
        let mode = weights.mode().name();
        let source = match weights.source() {
            // a profile of the published skin's readout leaves the rule to the skin
            LevelSource::Seeding(Seeding::Address) if weights.taxels() == SkinLayout::default().taxels() => None,
            LevelSource::Seeding(seeding) => Some(("seeding", toml::Value::try_from(seeding)?)),
            LevelSource::Seeds(seeds) => Some(("seeds", toml::Value::try_from(seeds.to_vec())?)),
            LevelSource::Patterns(patterns) => Some(("patterns", toml::Value::try_from(patterns.as_ref())?)),
        };
        if source.is_none() && base.get("weights").and_then(toml::Value::as_str) == Some(mode) {
            return Ok(None);
        }
        let mut lines = format!("weights = \"{mode}\"  # of the recordings\n");
        if let Some((key, value)) = source {
            let _ = writeln!(lines, "{key} = {value}  # of the recordings");
        }
        Ok(Some(lines))
    }

    /// The rate, from the beat unless that of the recordings agrees with it.
    fn rate_line(&self, base: &toml::Table) -> String {
        let base_hz = || base.get("sample_rate_hz").and_then(toml::Value::as_float);
        let base_hz = self.recorded_hz.or_else(base_hz);
        match (self.sample_rate_hz, self.beat, base_hz) {
            (Some(rate_hz), Some(beat), Some(base_hz)) if (rate_hz / base_hz - 1.0).abs() <= OSCILLATOR_SHARE => {
                format!(
                    "sample_rate_hz = {base_hz:?}  # kept: the beat says {rate_hz}{} Hz for cells of 20 MHz exactly\n",
                    error_text(beat, CELL_TIMER_HZ, 0)
                )
            }
            (Some(rate_hz), Some(beat), _) => format!(
                "sample_rate_hz = {rate_hz:?}  #{} Hz: beat of {:.2} measurements × {CELL_TIMER_HZ:.1} Hz\n",
                error_text(beat, CELL_TIMER_HZ, 0),
                beat.value
            ),
            (_, _, base_hz) => {
                base_hz.map(|v| format!("sample_rate_hz = {v:?}  # kept: no beat seen\n")).unwrap_or_default()
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
fn on_grid(adc: &mut toml::Value, steps: ConverterSteps) {
    let number = |key: &str| {
        let value = adc.get(key)?;
        value.as_float().or(value.as_integer().map(|i| i as f64))
    };
    let [Some(bits), Some(reference_v), Some(divider), Some(offset_v)] =
        ["bits", "reference_v", "divider", "offset_v"].map(number)
    else {
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

/// `value` with that many significant digits, with a point.
fn significant(value: f64, digits: i32) -> String {
    format!("{value:.*}", places(value, digits))
}

/// Places after the point that give `value` that many significant digits.
fn places(value: f64, digits: i32) -> usize {
    let magnitude = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    #[expect(clippy::cast_possible_truncation, reason = "a decimal exponent")]
    let places = (digits - 1 - magnitude as i32).clamp(1, 15);
    places.unsigned_abs() as usize
}

/// `value`, or `[low, high]`.
fn span_text((low, high): (f64, f64)) -> String {
    let (low, high) = (significant(low, DIGITS), significant(high, DIGITS));
    if low == high { low } else { format!("[{low}, {high}]") }
}

/// " ± error" in units of 1/`scale`; nothing without an error.
fn error_text(e: Estimated, scale: f64, places: usize) -> String {
    e.standard_error.map_or_else(String::new, |error| format!(" ± {:.places$}", scale * error))
}

fn words(e: &Estimated) -> String {
    match e.standard_error {
        Some(error) => {
            let places = places(error, ERROR_DIGITS);
            format!("{:.places$} ± {error:.places$}, n = {}", e.value, e.n)
        }
        None => format!("{}, n = 1: no uncertainty", significant(e.value, DIGITS)),
    }
}

/// Faults of the profile. A fault belongs to one session, not to the skin: from several sessions, and what no fault
/// model describes, as comments.
fn fault_lines(sessions: &[SessionEstimates]) -> String {
    let mut out = String::new();
    let [session] = sessions else {
        for s in sessions {
            for fault in &s.faults {
                let _ = writeln!(out, "\n# found in {}, not in this profile: {fault}", s.session);
            }
        }
        return out;
    };
    for cell in &session.overdriven {
        let (fault, Overdriven { gain, carry, bias, .. }) = (fault("overdriven", cell.taxel, cell.seed), cell);
        let _ = writeln!(out, "{fault}\ngain = {gain:.3}\ncarry = {carry:.3}\nbias = {bias:.3}");
    }
    let described = |cell: &Reseeded| session.overdriven.iter().any(|o| o.taxel == cell.taxel);
    for found in &session.faults {
        let _ = match found.reseeded() {
            Some(cell) if described(&cell) => Ok(()),
            Some(cell) => writeln!(out, "{}", fault("mis_seeded", cell.taxel, cell.seed)),
            None => writeln!(out, "\n# found, not modelled: {found}"),
        };
    }
    out
}

/// A fault of a cell in a profile.
fn fault(name: &str, taxel: u32, seed: u32) -> String {
    format!("\n[[faults]]\nname = \"{name}\"\ntaxel = {taxel}\nseed = {seed}")
}

/// The profile of `readings` and its text, for a skin of `taxels` taxels. Undetermined parameters are taken from the
/// default readout.
///
/// # Errors
/// [`Refusal`] if a value is outside its range.
pub fn fitted_profile(readings: &FittedReadout, taxels: u32) -> Result<(Profile, String), Refusal> {
    let base = shipped(DEFAULT_READOUT)?;
    let text = readings.to_toml(&base).map_err(Refusal::from_error)?;
    let profile = Profile::from_toml(&text)?;
    profile.validate(taxels)?;
    Ok((profile, text))
}

/// A parameter and where it comes from: section and key of the profile; name of its value in [`super::NUMBERS`];
/// smallest and largest valid value of the readout (rates, shares and noise are not negative).
type Parameter = (&'static str, &'static str, [f64; 2]);

/// In the order of the profile.
const PARAMETERS: [Parameter; 8] = [
    // half a beat of 52.4 measurements; see the effect `late_updates`
    (LATE_RATE, "late_per_flip", [0.0, 0.5 / 53.0]),
    ("drive_offset.constant_v", "constant", [-5.0, 5.0]),
    ("drive_offset.asymmetry", "asymmetry", [-0.5, 0.5]),
    ("memory.h1", "h1", [-0.4, 0.4]),
    ("memory.h2", "h2", [-0.4, 0.4]),
    ("clock_pattern.amplitude_v", "parity", [-2.0, 2.0]),
    ("contact_noise.fraction", "contact_fraction", [0.0, 1.0]),
    ("idle_noise.sd_v", IDLE_NOISE, [0.0, 10.0]),
];

/// The number that the converter's rounding adds step²/12 to.
const IDLE_NOISE: &str = "idle_noise";

/// A session's value of a parameter, NaN if the session does not determine it; of the idle noise, the noise floor
/// before the converter.
fn session_value(s: &SessionEstimates, number: &str) -> f64 {
    let value = s.value(number);
    if number != IDLE_NOISE {
        return value;
    }
    let step_v = s.steps.map_or(0.0, |s| s.step_v);
    (value.powi(2) - step_v.powi(2) / 12.0).max(0.0).sqrt()
}

/// The one parameter that is drawn once a taxel, not once a session.
const LATE_RATE: &str = "late_updates.rate";

/// A parameter of the profile, with one value for each session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedParameter {
    /// Section and key.
    pub name: &'static str,
    /// Value of every session that determines it.
    pub sessions: Vec<f64>,
    /// Span for the profile, in which a new session lies with probability [`super::COVERAGE`]; for the late rate, which
    /// differs from taxel to taxel, the spread over the taxels. `None` if no session determines it.
    pub span: Option<(f64, f64)>,
    /// Mean over the sessions (for one session, median over its presses) and standard error.
    pub estimate: Estimated,
}

/// A parameter, from all `sessions` together, or of one.
fn fitted(&(name, number, limits): &Parameter, sessions: &[SessionEstimates]) -> FittedParameter {
    let values = sessions.iter().map(|s| session_value(s, number));
    let values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let estimate = match sessions {
        [only] => Estimated {
            value: values.first().copied().unwrap_or(f64::NAN),
            ..only.numbers.get(number).copied().unwrap_or(Estimated::mean_of(&[]))
        },
        _ => Estimated::mean_of(&values),
    };
    let mut span = predicted(&values).map(|span| clipped(span, limits));
    // one session's own value is known better than which of its taxels are the late ones: drawn anew, they would change
    // it
    if name == LATE_RATE && sessions.len() > 1 {
        span = late_span(estimate.value, sessions).or(span);
    }
    FittedParameter { name, span, sessions: values, estimate }
}

/// Whether every session lies in the spans that the others predict; of the late rate, its mean over the taxels. `None`
/// with fewer than three sessions.
pub(super) fn predicted_inside(sessions: &[SessionEstimates]) -> Option<PredictedInside> {
    let of = |&(name, number, limits): &Parameter| {
        let values = sessions.iter().map(|s| (s.session.as_str(), session_value(s, number)));
        leave_one_out(name, limits, &values.filter(|(_, v)| v.is_finite()).collect::<Vec<_>>())
    };
    PredictedInside::of(PARAMETERS.iter().filter_map(of).collect())
}

/// Span of a uniform distribution over the taxels about `centre`, not below 0: standard deviation of the shares of late
/// flips over the loaded taxels of all sessions, less what the number of events makes of it. `None` with fewer than two
/// taxels.
fn late_span(centre: f64, sessions: &[SessionEstimates]) -> Option<(f64, f64)> {
    let cells = || sessions.iter().flat_map(|s| &s.late_cells);
    let shares: Vec<f64> = cells().map(|c| c.per_flip).collect();
    let n = shares.len() as f64;
    if n < 2.0 || !centre.is_finite() {
        return None;
    }
    let counting = mean(&cells().map(|c| c.standard_error.powi(2)).collect::<Vec<_>>());
    let variance = sd(&shares).powi(2) * n / (n - 1.0) - counting;
    // a uniform distribution reaches √3 standard deviations to either side
    let reach = (3.0 * variance.max(0.0)).sqrt().min(centre);
    Some((centre - reach, centre + reach))
}
