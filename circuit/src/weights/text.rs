//! Weights, seeds and patterns as text.

use super::lcg::Seeding;
use super::sequence::{LevelSource, Patterns, PatternsConfig, WeightMode, Weights};
use crate::wires::Wires;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use spts_input::Refusal;
use std::fmt::Write as _;

/// Text of [`Weights`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WeightsConfig {
    mode: WeightMode,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    taxels: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    generator: Option<Generator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seeding: Option<Seeding>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seeds: Option<Vec<u32>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    patterns: Option<Patterns>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wires: Option<Wires>,
}

/// The generators that cells have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Generator {
    /// The firmware's linear congruential generator; see [`Jump`](crate::Jump).
    Lcg,
}

impl From<&Weights> for WeightsConfig {
    fn from(weights: &Weights) -> Self {
        let mut config = Self {
            mode: weights.mode(),
            taxels: None,
            generator: Some(Generator::Lcg),
            seeding: None,
            seeds: None,
            patterns: None,
            wires: weights.wires().cloned(),
        };
        match weights.source() {
            LevelSource::Seeding(seeding) => {
                config.seeding = Some(*seeding);
                config.taxels = u32::try_from(weights.taxels()).ok();
            }
            LevelSource::Seeds(seeds) => config.seeds = Some(seeds.to_vec()),
            LevelSource::Patterns(patterns) => {
                config.generator = None;
                config.patterns = Some(Patterns::clone(patterns));
            }
        }
        config
    }
}

impl TryFrom<WeightsConfig> for Weights {
    type Error = Refusal;
    fn try_from(config: WeightsConfig) -> Result<Self, Refusal> {
        let WeightsConfig { mode, taxels, generator, seeding, seeds, patterns, wires } = config;
        if generator.is_some() && patterns.is_some() {
            return Err(one_source("`generator`, `patterns`"));
        }
        let raster = mode == WeightMode::Raster && seeds.is_none() && patterns.is_none();
        let seeding = seeding.or(raster.then_some(Seeding::Address));
        Self::from_one(mode, taxels, (seeding, "`seeding`"), seeds.as_deref(), patterns.as_ref())?.wired(wires)
    }
}

impl Weights {
    /// Weights from the one source that is given; a rule is shown with its name. A list decides the number of taxels,
    /// unless that is given, too, and is then checked.
    ///
    /// # Errors
    /// [`Refusal`] for no source or several, for a rule without a number of taxels, or for a list that is not valid.
    pub(crate) fn from_one(
        mode: WeightMode,
        taxels: Option<u32>,
        (seeding, shown): (Option<Seeding>, &str),
        seeds: Option<&[u32]>,
        patterns: Option<&Patterns>,
    ) -> Result<Self, Refusal> {
        let (weights, field) = match (seeding, seeds, patterns) {
            (Some(seeding), None, None) => {
                let missing = || Refusal::new("`taxels` is missing; valid: [1, 2^32 − 1]");
                return Ok(Self::new(mode, seeding, taxels.ok_or_else(missing)?));
            }
            (None, Some(seeds), None) => (Self::with_seeds(mode, seeds)?, "seeds"),
            (None, None, Some(patterns)) => (Self::with_patterns(mode, patterns.clone())?, "patterns"),
            _ => {
                let given = [seeding.map(|_| shown), seeds.map(|_| "`seeds`"), patterns.map(|_| "`patterns`")];
                let found = given.into_iter().flatten().collect::<Vec<_>>().join(", ");
                return Err(one_source(if found.is_empty() { "none" } else { &found }));
            }
        };
        let found = weights.taxels();
        match taxels {
            Some(taxels) if taxels as usize != found => {
                Err(Refusal::new(format!("`{field}` is for {found} taxels; expected {taxels}")))
            }
            _ => Ok(weights),
        }
    }
}

/// Weights with no source of the levels, or several: the keys `found`.
fn one_source(found: &str) -> Refusal {
    Refusal::new(format!("weights need exactly one of `seeding`, `seeds` and `patterns`; found: {found}"))
}

impl Serialize for Weights {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        WeightsConfig::from(self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Weights {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(WeightsConfig::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

/// Size of the largest file of seeds that is read, bytes: a million seeds in any notation.
pub const MAX_SEEDS_BYTES: u64 = 1 << 24;
/// Characters of a wrong word that an error repeats: a few more than a seed has.
const SHOWN: usize = 20;

/// A wrong word, shortened, in the line `index`, from 0.
fn wrong(index: usize, word: &str, before: &str, after: &str) -> Refusal {
    let word: String = word.chars().take(SHOWN).collect();
    Refusal::new(format!("line {}: {before}{word}{after}", index + 1))
}

/// Reads seeds, one a taxel in row-major order: whole numbers in [0, 4294967295], decimal or hexadecimal (0x…),
/// separated by spaces, commas or line ends. A # starts a comment. A JSON list of numbers is accepted, too.
///
/// ```
/// use spts_circuit::parse_seeds;
///
/// assert_eq!(parse_seeds("# two cells\n8\n0x09\n")?, [8, 9]);
/// assert_eq!(parse_seeds("[8, 9]")?, [8, 9]);
/// assert!(parse_seeds("8\n-1").unwrap_err().to_string().starts_with("line 2: seed = `-1`"));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] for the first word that is not a seed.
pub fn parse_seeds(text: &str) -> Result<Vec<u32>, Refusal> {
    let trimmed = text.trim();
    let json = trimmed.starts_with('[') && trimmed.ends_with(']');
    let between = |c: char| matches!(c, ',' | ' ' | '\t' | '\r') || (json && matches!(c, '[' | ']'));
    let mut seeds = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        for word in line.split(between).filter(|word| !word.is_empty()) {
            let seed = match word.strip_prefix("0x") {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => word.parse(),
            };
            let seed = seed
                .map_err(|_| wrong(index, word, "seed = `", "` is not one of the whole numbers in [0, 4294967295]"))?;
            seeds.push(seed);
        }
    }
    Ok(seeds)
}

/// Size of the largest file of patterns that is read, bytes.
pub const MAX_PATTERNS_BYTES: u64 = 1 << 26;
/// Reads a pattern: one line for each row of the sensing matrix, in order of output. A row has one sign for each taxel
/// (`+` is code 255, level +1; `−` is code 0, level −1), or codes in [0, 255] separated by spaces or commas. The
/// keyboard's hyphen also counts as `−`. A `#` starts a comment.
///
/// ```
/// use spts_circuit::parse_patterns;
///
/// let patterns = parse_patterns("# two rows, three taxels\n+-+\n0 255 128\n")?;
/// assert_eq!((patterns.row(0), patterns.row(1)), (&[255, 0, 255][..], &[0, 255, 128][..]));
/// assert!(parse_patterns("+-\n+").is_err());
/// # Ok::<(), spts_input::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] for the first word that is neither, rows of different lengths, or a text without rows.
pub fn parse_patterns(text: &str) -> Result<Patterns, Refusal> {
    let (mut codes, mut rows, mut taxels) = (Vec::new(), 0, None);
    for (index, line) in text.lines().enumerate() {
        let before = codes.len();
        for word in line.split('#').next().unwrap_or_default().split([',', ' ', '\t', '\r']) {
            if word.is_empty() {
                continue;
            }
            if let Some(signs) = signs(word) {
                codes.extend(signs);
                continue;
            }
            let code = word.parse().map_err(|_| {
                wrong(index, word, "`", "` is neither a row of + and − signs nor one of the codes in [0, 255]")
            })?;
            codes.push(code);
        }
        let found = codes.len() - before;
        if found == 0 {
            continue;
        }
        rows += 1;
        let first = *taxels.get_or_insert(found);
        if found != first {
            let expected = format!("the rows before it have {first}");
            return Err(Refusal::new(format!("line {}: a row of {found} taxels; {expected}", index + 1)));
        }
    }
    Patterns::new(rows, codes)
}

/// Codes of a word of signs.
fn signs(word: &str) -> Option<Vec<u8>> {
    let code = |c| match c {
        '+' => Some(255),
        '-' | '−' => Some(0),
        _ => None,
    };
    word.chars().map(code).collect()
}

impl<'de> Deserialize<'de> for Patterns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOrCodes)
    }
}

/// Reads patterns from a text, or from period and codes.
struct TextOrCodes;

impl<'de> de::Visitor<'de> for TextOrCodes {
    type Value = Patterns;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("rows of signs as a text, or a table of `period` and `codes`")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Patterns, E> {
        parse_patterns(text).map_err(E::custom)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<Patterns, A::Error> {
        let config = PatternsConfig::deserialize(de::value::MapAccessDeserializer::new(map))?;
        Patterns::try_from(config).map_err(de::Error::custom)
    }
}

impl Patterns {
    /// The pattern as text for [`parse_patterns`]: signs if all codes are 0 or 255, otherwise codes.
    pub fn to_text(&self) -> String {
        let rows = (0..self.period() as u64).map(|row| self.row(row));
        let binary = rows.clone().flatten().all(|code| matches!(code, 0 | 255));
        let mut out = String::new();
        for row in rows {
            for (taxel, code) in row.iter().enumerate() {
                if binary {
                    out.push(if *code == 0 { '-' } else { '+' });
                } else {
                    // a String takes everything
                    let _ = write!(out, "{}{code}", if taxel == 0 { "" } else { " " });
                }
            }
            out.push('\n');
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_back() {
        for codes in [vec![0, 255, 255, 255, 0, 0], vec![0, 1, 2, 128, 254, 255]] {
            for period in [1, 2, 3] {
                let patterns = Patterns::new(period, codes.clone()).unwrap();
                let (text, json) = (patterns.to_text(), serde_json::to_string(&patterns).unwrap());
                assert_eq!(parse_patterns(&text).as_ref(), Ok(&patterns));
                assert_eq!(serde_json::from_str::<Patterns>(&json).unwrap(), patterns);
                let json = serde_json::to_string(&text).unwrap();
                assert_eq!(serde_json::from_str::<Patterns>(&json).unwrap(), patterns);
            }
        }
    }

    #[test]
    fn what_is_no_pattern_is_refused_with_its_line() {
        for (text, said) in [
            ("", "`patterns.codes` has 0 entries"),
            ("# nothing", "`patterns.codes` has 0 entries"),
            ("+-\n\n+-+", "line 3: a row of 3 taxels; the rows before it have 2"),
            ("+-\n256 1", "line 2: `256`"),
            ("+x-", "line 1: `+x-`"),
            ("1 -1", "line 1: `-1`"),
            ("nan", "line 1: `nan`"),
        ] {
            let error = parse_patterns(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text:?}: {error}");
        }
    }
}
