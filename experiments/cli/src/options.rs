//! Options that several commands have.

use crate::error::CliError;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use spts::chain::MAX_TOML_BYTES;
use spts_contact::objects::{ObjectSpec, pressable};
use spts_eval::Sensing;
use spts_eval::decoders::{AUTO, DECODERS, DecoderSpec, find};
use spts_eval::training::TrainedNetwork;
use spts_models::{SkinLayout, TaxelGains};
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;
use std::str::FromStr;

/// Parser of a whole number within `range`.
pub(super) fn whole<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync,
{
    move |text| {
        let value = text.parse().ok().filter(|value| range.contains(value));
        value.ok_or_else(|| format!("is outside the whole numbers in [{}, {}]", range.start(), range.end()))
    }
}

/// Parser of a number whose range depends on the scene.
pub(super) fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "is not a number".to_owned())
}

/// A number with one of `units`, or without.
pub(super) fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    for (unit, scale) in units {
        if let Some(number) = text.strip_suffix(unit) {
            return number.trim().parse().ok().map(|v: f64| v * scale);
        }
    }
    text.parse().ok()
}

/// Units of a length, m.
pub(super) const LENGTHS: [(&str, f64); 5] = [("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6), ("µm", 1e-6), ("m", 1.0)];

/// Parser of a length, m.
pub(super) fn length(text: &str) -> Result<f64, String> {
    let found = with_unit(text, &LENGTHS);
    let range = found.filter(|m| (1e-4..=1.0).contains(m));
    range.ok_or_else(|| "is not a length in [0.1mm, 1m], as 5mm or 0.005".to_owned())
}

/// Parser of a seed. A seed is kept in scenes, and a TOML integer has a sign.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    let seed = text.parse().ok().filter(|seed| i64::try_from(*seed).is_ok());
    seed.ok_or_else(|| "is outside the whole numbers in [0, 2^63)".to_owned())
}

/// Parser of an object that is pressed: one of the seventeen, or the finger.
pub(super) fn pressed(text: &str) -> Result<&'static ObjectSpec, String> {
    pressable().find(|object| object.name == text).ok_or_else(|| {
        let names: Vec<&str> = pressable().map(|object| object.name).collect();
        format!("is none of {}", names.join(", "))
    })
}

/// Parser of a way in which rows come about; `--worst-kind` makes those that are chosen [`Sensing::WorstKind`].
pub(super) fn sensing() -> impl TypedValueParser<Value = Sensing> {
    let known = [Sensing::Random, Sensing::Chosen];
    let named = move |name: String| known.into_iter().find(|s| s.name() == name).unwrap_or_default();
    PossibleValuesParser::new(known.map(Sensing::name)).map(named)
}

/// Most measurements of one window: the scored frames of a press hold 20,000.
const MAX_MEASUREMENTS: usize = 1000;

/// Parser of a number of measurements.
pub(super) fn parse_measurements(text: &str) -> Result<usize, String> {
    whole(1..=MAX_MEASUREMENTS)(text)
}

/// `numbers` in rising order, each once.
pub(super) fn sorted<T: Ord>(mut numbers: Vec<T>) -> Vec<T> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// `numbers` in rising order, each once.
pub(super) fn sorted_numbers(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers.dedup_by_key(|number| number.to_bits());
    numbers
}

/// Taxels along one side of a square skin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side(pub(super) usize);

/// Parser of a number of taxels that is the square of a side within `sides`.
pub(super) fn square(sides: RangeInclusive<usize>) -> impl Fn(&str) -> Result<Side, String> + Clone + Send + Sync {
    move |text| {
        let taxels: Option<usize> = text.parse().ok();
        let side = taxels.map(usize::isqrt).filter(|side| taxels == Some(side * side));
        side.filter(|side| sides.contains(side)).map(Side).ok_or_else(|| {
            let [least, most] = [sides.start(), sides.end()].map(|side| side * side);
            format!("is outside the square numbers in [{least}, {most}]")
        })
    }
}

/// Parser of a number from `min` to `max`, which `range` says in words.
pub(super) fn within(
    min: f64,
    max: f64,
    range: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    move |text| {
        let value = text.parse().ok().filter(|value| (min..=max).contains(value));
        value.ok_or_else(|| format!("is outside {range}"))
    }
}

/// The decoders with these names; `all` stands for every one, and `auto` for `chosen`, where there is one.
///
/// # Errors
/// [`CliError`] for a name that no decoder has.
pub(super) fn decoders_named(
    names: &[String],
    chosen: Option<&'static DecoderSpec>,
) -> Result<Vec<&'static DecoderSpec>, CliError> {
    if names.iter().any(|n| n == "all") {
        return Ok(DECODERS.iter().collect());
    }
    let one = |name: &String| {
        chosen.filter(|_| name == AUTO).or_else(|| find(name)).ok_or_else(|| {
            let valid: Vec<&str> = DECODERS.iter().map(|spec| spec.name).collect();
            let auto = if chosen.is_some() { "auto, " } else { "" };
            CliError::usage(format!("`--decoder` = {name:?}; valid: {auto}all, {}", valid.join(", ")))
        })
    };
    let mut found: Vec<&DecoderSpec> = Vec::new();
    for spec in names.iter().map(one) {
        let spec = spec?;
        if !found.iter().any(|known| known.name == spec.name) {
            found.push(spec);
        }
    }
    Ok(found)
}

/// The trained network in the file at `path`.
///
/// # Errors
/// [`CliError`] when it holds none.
pub(super) fn network(path: &Path) -> Result<TrainedNetwork, CliError> {
    TrainedNetwork::open(path).map_err(|e| CliError::usage(format!("`--weights`: {e}")))
}

/// The gains in the file `path`, of a skin of this `layout`.
///
/// # Errors
/// [`CliError`] with the file and what is wrong with it.
pub(crate) fn skin_gains(path: &Path, layout: &SkinLayout) -> Result<TaxelGains, CliError> {
    let failed = |reason: String| CliError::usage(format!("{}: {reason}", path.display()));
    let text = spts_input::read_text(path, MAX_TOML_BYTES).map_err(|error| failed(error.to_string()))?;
    let gains = TaxelGains::from_toml(&text).map_err(&failed)?;
    gains.check_skin(layout).map_err(|error| failed(error.to_string()))?;
    Ok(gains)
}
