//! Options that several commands have.

use super::error::CliError;
use spts_eval::decoders::{DECODERS, DecoderSpec, find};
use std::ops::RangeInclusive;

/// Most measurements of one window: the scored frames of a press hold 20,000.
const MAX_MEASUREMENTS: usize = 1000;

/// Parser of a number of measurements.
pub(super) fn parse_measurements(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(m) if (1..=MAX_MEASUREMENTS).contains(&m) => Ok(m),
        _ => Err(format!("valid range: the whole numbers in [1, {MAX_MEASUREMENTS}]")),
    }
}

/// `numbers` in rising order, each once.
pub(super) fn sorted<T: Ord>(mut numbers: Vec<T>) -> Vec<T> {
    numbers.sort_unstable();
    numbers.dedup();
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
            format!("valid range: the square numbers in [{least}, {most}]")
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
        value.ok_or_else(|| format!("valid range: {range}"))
    }
}

/// The decoders with these names; `all` stands for every one.
///
/// # Errors
/// [`CliError::Usage`] for a name that no decoder has.
pub(super) fn decoders_named(names: &[String]) -> Result<Vec<&'static DecoderSpec>, CliError> {
    if names.iter().any(|n| n == "all") {
        return Ok(DECODERS.iter().collect());
    }
    let one = |name: &String| {
        find(name).ok_or_else(|| {
            let valid: Vec<&str> = DECODERS.iter().map(|spec| spec.name).collect();
            CliError::Usage(format!("`--decoder` = {name:?}; valid: all, {}", valid.join(", ")))
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
