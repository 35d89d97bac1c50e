//! Numbers of a specification, fixed or random.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use serde::{Deserialize, Deserializer, de::Error as _};
use spts::Refusal;
use spts_models::{Streams, in_section, within};
use toml::{Table, Value};

/// Names of the distributions: a table with one of these keys alone is a draw.
const DISTRIBUTIONS: [&str; 5] = ["uniform", "log_uniform", "normal", "choice", "grid"];

/// A normal distribution is cut at so many standard deviations, so that its range is known.
const NORMAL_CUT: f64 = 4.0;
/// Most values of a grid that is given by its ends.
const MOST_STEPS: i64 = 100_000;

/// A number of a specification: the same for all rows, or drawn.
///
/// In TOML a number, or a table with one key: `{ uniform = [low, high] }`, `{ log_uniform = [low, high] }`, `{ normal =
/// [mean, sd] }` (limited to four standard deviations), `{ choice = [a, b, …] }` (all equally likely), or `{ grid = [a,
/// b, …] }` and `{ grid = { from = a, to = b, steps = n } }`. The grids of a specification run through all their
/// combinations, the first grid fastest.
///
/// ```
/// use spts_dataset::Draw;
/// use spts_models::Streams;
///
/// let value = toml::toml! { force_n = { log_uniform = [5.0, 50.0] } };
/// let force_n = Draw::from_toml(&value["force_n"])?;
/// assert_eq!(force_n.range(), [5.0, 50.0]);
/// let streams = Streams::new(1);
/// assert!((0..100).all(|row| (5.0..=50.0).contains(&force_n.value(streams, "force", row))));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Draw {
    /// Always this number.
    Fixed(f64),
    /// Uniform between the two.
    Uniform([f64; 2]),
    /// Its logarithm is uniform between those of the two.
    LogUniform([f64; 2]),
    /// Mean and standard deviation.
    Normal([f64; 2]),
    /// One of these, all equally likely.
    Choice(Vec<f64>),
    /// All of these in turn.
    Grid {
        /// The values.
        values: Vec<f64>,
        /// Number of consecutive items with the same value: the product of the lengths of the grids before it.
        stride: u64,
    },
}

impl Draw {
    /// The number of item `index`. It depends only on the draw, `streams`, `label` and `index`.
    pub fn value(&self, streams: Streams, label: &str, index: u64) -> f64 {
        let rng = || streams.rng(label, index);
        match self {
            Self::Fixed(value) => *value,
            Self::Uniform([low, high]) => low + (high - low) * rng().random::<f64>(),
            Self::LogUniform([low, high]) => {
                let (a, b) = (low.ln(), high.ln());
                (a + (b - a) * rng().random::<f64>()).exp().clamp(*low, *high)
            }
            Self::Normal([mean, sd]) => {
                let normal: f64 = StandardNormal.sample(&mut rng());
                mean + sd * normal.clamp(-NORMAL_CUT, NORMAL_CUT)
            }
            Self::Choice(values) => values[rng().random_range(0..values.len())],
            Self::Grid { values, stride } => {
                let place = index / stride % values.len() as u64;
                // less than the length
                usize::try_from(place).map_or(f64::NAN, |place| values[place])
            }
        }
    }

    /// Whether all items have the same number.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Self::Fixed(_))
    }

    /// Smallest and largest possible number.
    pub fn range(&self) -> [f64; 2] {
        match self {
            Self::Fixed(value) => [*value; 2],
            Self::Uniform(ends) | Self::LogUniform(ends) => *ends,
            Self::Normal([mean, sd]) => [mean - NORMAL_CUT * sd, mean + NORMAL_CUT * sd],
            Self::Choice(values) | Self::Grid { values, .. } => {
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                [low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
            }
        }
    }

    /// Refuses the first end of its range that is outside [`least`, `most`]; `range` is that interval as text.
    pub(super) fn within(&self, field: &str, least: f64, most: f64, range: &'static str) -> Result<(), Refusal> {
        let mut ends = self.range().into_iter();
        ends.try_for_each(|end| within(field, end, least, most, range))
    }

    /// Makes it the grid that changes after `stride` items, if it is a grid, and counts its values.
    pub(crate) fn take_turn(&mut self, turn: &mut u64) {
        if let Self::Grid { values, stride } = self {
            *stride = *turn;
            *turn = turn.saturating_mul(values.len() as u64);
        }
    }

    /// The draw that `value` describes.
    ///
    /// # Errors
    /// A message that says what is wrong.
    pub fn from_toml(value: &Value) -> Result<Self, String> {
        if let Some(number) = number(value) {
            return number.map(Self::Fixed);
        }
        let needed = "a number or a table with one of `uniform`, `log_uniform`, `normal`, `choice`, `grid` is needed";
        let Some(table) = value.as_table().filter(|table| table.len() == 1) else {
            return Err(needed.to_owned());
        };
        let Some((key, value)) = table.iter().next() else {
            return Err(needed.to_owned());
        };
        let drawn = match key.as_str() {
            "uniform" => pair(value).and_then(|p| rising(p).map(Self::Uniform)),
            "log_uniform" => pair(value).and_then(|p| match rising(p) {
                Ok([low, _]) if low <= 0.0 => Err(format!("{low} is not above 0")),
                ends => ends.map(Self::LogUniform),
            }),
            "normal" => pair(value).and_then(|[mean, sd]| {
                let ok = sd >= 0.0;
                ok.then_some(Self::Normal([mean, sd])).ok_or_else(|| format!("a standard deviation of {sd} is below 0"))
            }),
            "choice" => list(value).map(Self::Choice),
            "grid" => grid(value).map(|values| Self::Grid { values, stride: 1 }),
            _ => return Err(format!("`{key}` is not a distribution; {needed}")),
        };
        drawn.map_err(|problem| format!("`{key}`: {problem}"))
    }
}

impl<'de> Deserialize<'de> for Draw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_toml(&Value::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

/// The number that `value` is, if it is one; an error for one that is not finite.
fn number(value: &Value) -> Option<Result<f64, String>> {
    let number = match value {
        Value::Float(number) => *number,
        Value::Integer(number) => *number as f64,
        _ => return None,
    };
    let finite = number.is_finite().then_some(number);
    Some(finite.ok_or_else(|| format!("{number} is not finite")))
}

fn list(value: &Value) -> Result<Vec<f64>, String> {
    let values = value.as_array().filter(|values| !values.is_empty());
    let values = values.ok_or("a list of numbers is needed")?;
    let numbers = values.iter().map(|v| number(v).unwrap_or_else(|| Err(format!("{v} is not a number"))));
    numbers.collect()
}

fn pair(value: &Value) -> Result<[f64; 2], String> {
    let found = list(value)?;
    <[f64; 2]>::try_from(found).map_err(|found| format!("two numbers are needed, found {}", found.len()))
}

fn rising([low, high]: [f64; 2]) -> Result<[f64; 2], String> {
    if low <= high { Ok([low, high]) } else { Err(format!("{low} is above {high}")) }
}

fn grid(value: &Value) -> Result<Vec<f64>, String> {
    let Some(table) = value.as_table() else {
        return list(value);
    };
    let get = |key: &str| table.get(key).ok_or_else(|| format!("`{key}` is missing"));
    let end = |key: &str| number(get(key)?).unwrap_or_else(|| Err(format!("`{key}` is not a number")));
    let (from, to) = (end("from")?, end("to")?);
    let steps = get("steps")?.as_integer().filter(|n| (1..=MOST_STEPS).contains(n));
    let steps = steps.ok_or_else(|| format!("`steps` is outside the whole numbers in [1, {MOST_STEPS}]"))?;
    let at = |k: i64| from + (to - from) * k as f64 / (steps - 1).max(1) as f64;
    Ok((0..steps).map(at).collect())
}

/// A number that was drawn as a whole one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
pub(crate) fn whole(value: f64) -> usize {
    value.round() as usize
}

/// Parameters that go to others, such as a transducer's, with their draws.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Template {
    table: Table,
}

impl Template {
    pub(crate) fn new(table: Table) -> Self {
        Self { table }
    }

    /// The table of item `index`, every draw replaced by its number. `section` names the table.
    ///
    /// # Errors
    /// [`Refusal`] for a draw that is none.
    pub(crate) fn of(&self, streams: Streams, section: &str, index: u64) -> Result<Table, Refusal> {
        let mut turn = 1;
        filled(&self.table, section, &mut |mut draw, field| {
            draw.take_turn(&mut turn);
            draw.value(streams, field, index)
        })
    }

    /// The table with every draw at its least number, and with every draw at its largest.
    ///
    /// # Errors
    /// As for [`Template::of`].
    pub(crate) fn ends(&self, section: &str) -> Result<[Table; 2], Refusal> {
        let end = |k: usize| filled(&self.table, section, &mut |draw, _| draw.range()[k]);
        Ok([end(0)?, end(1)?])
    }
}

/// `table` with the numbers that `number` gives for its draws and their fields.
fn filled(table: &Table, section: &str, number: &mut dyn FnMut(Draw, &str) -> f64) -> Result<Table, Refusal> {
    let mut out = Table::new();
    for (key, value) in table {
        let field = format!("{section}.{key}");
        let value = match value {
            Value::Table(inner) if is_draw(inner) => {
                let draw = Draw::from_toml(value);
                let draw = draw.map_err(|problem| Refusal::new(in_section(&field, &problem)))?;
                Value::Float(number(draw, &field))
            }
            Value::Table(inner) => Value::Table(filled(inner, &field, number)?),
            other => other.clone(),
        };
        out.insert(key.clone(), value);
    }
    Ok(out)
}

/// Whether `table` writes a distribution.
pub(super) fn is_draw(table: &Table) -> bool {
    table.len() == 1 && table.keys().all(|key| DISTRIBUTIONS.contains(&key.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(text: &str) -> Result<Draw, String> {
        let table: toml::Table = toml::from_str(&format!("x = {text}")).unwrap();
        Draw::from_toml(&table["x"])
    }

    /// Moments of 20,000 draws: standard error of a mean sd/√n, five of them.
    #[test]
    fn distributions_have_their_moments() {
        let n = 20_000_u32;
        for (text, mean, sd) in [
            ("3", 3.0, 0.0),
            ("{ uniform = [1, 3] }", 2.0, 2.0 / 12.0_f64.sqrt()),
            ("{ normal = [5, 0.5] }", 5.0, 0.5),
            ("{ choice = [0, 10] }", 5.0, 5.0),
            // ∫ x / (x ln 100) dx over [1, 100]; variance (100² − 1)/(2 ln 100) − mean²
            (
                "{ log_uniform = [1, 100] }",
                99.0 / 100.0_f64.ln(),
                (9999.0 / (2.0 * 100.0_f64.ln()) - (99.0 / 100.0_f64.ln()).powi(2)).sqrt(),
            ),
        ] {
            let draw = draw(text).unwrap();
            let values: Vec<f64> = (0..n).map(|k| draw.value(Streams::new(1), "x", k.into())).collect();
            let found = values.iter().sum::<f64>() / f64::from(n);
            assert!((found - mean).abs() <= 5.0 * sd / f64::from(n).sqrt(), "{text}: {found}");
            let [low, high] = draw.range();
            assert!(values.iter().all(|v| (low..=high).contains(v)), "{text}");
        }
    }

    #[test]
    fn grids_take_all_combinations() {
        let mut grids =
            [draw("{ grid = [1, 2, 3] }").unwrap(), draw("{ grid = { from = 0, to = 1, steps = 2 } }").unwrap()];
        let mut turn = 1;
        for grid in &mut grids {
            grid.take_turn(&mut turn);
        }
        assert_eq!(turn, 6);
        let all: Vec<[f64; 2]> =
            (0..7).map(|k| [0, 1].map(|g: usize| grids[g].value(Streams::new(0), "", k))).collect();
        assert_eq!(all, [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [1.0, 0.0]]);
    }

    #[test]
    fn nonsense_is_refused() {
        for (text, said) in [
            ("\"much\"", "a number or a table"),
            ("{ uniform = [3, 1] }", "3 is above 1"),
            ("{ uniform = [1, 2, 3] }", "found 3"),
            ("{ log_uniform = [0, 1] }", "is not above 0"),
            ("{ normal = [0, -1] }", "below 0"),
            ("{ choice = [] }", "a list of numbers"),
            ("{ beta = [1, 2] }", "`beta` is not a distribution"),
            ("{ grid = { from = 0, to = 1, steps = 0 } }", "`steps` is outside"),
            ("nan", "NaN is not finite"),
            ("{ uniform = [0, inf] }", "inf is not finite"),
            ("{ uniform = [0, 1], normal = [0, 1] }", "with one of"),
        ] {
            let problem = draw(text).unwrap_err();
            assert!(problem.contains(said), "{text}: {problem}");
        }
    }
}
