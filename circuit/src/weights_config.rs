//! Weights as text.

use crate::level_source::LevelSource;
use crate::mode::WeightMode;
use crate::patterns::Patterns;
use crate::seeding::Seeding;
use crate::weights::Weights;
use crate::weights_error::WeightsError;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

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
    type Error = WeightsError;
    fn try_from(config: WeightsConfig) -> Result<Self, WeightsError> {
        let mode = config.mode;
        if config.generator.is_some() && config.patterns.is_some() {
            let found = "`generator`, `patterns`".to_owned();
            return Err(WeightsError::Source { found });
        }
        let (weights, field) = match (config.seeding, config.seeds, config.patterns) {
            (None, None, None) if mode == WeightMode::Raster => {
                let taxels = config.taxels.ok_or(WeightsError::NoTaxels)?;
                return Ok(Self::new(mode, Seeding::Address, taxels));
            }
            (Some(seeding), None, None) => {
                let taxels = config.taxels.ok_or(WeightsError::NoTaxels)?;
                return Ok(Self::new(mode, seeding, taxels));
            }
            (None, Some(seeds), None) => (Self::with_seeds(mode, seeds)?, "seeds"),
            (None, None, Some(patterns)) => (Self::with_patterns(mode, patterns)?, "patterns"),
            (seeding, seeds, patterns) => {
                let given = [
                    seeding.map(|_| "`seeding`"),
                    seeds.map(|_| "`seeds`"),
                    patterns.map(|_| "`patterns`"),
                ];
                let given: Vec<&str> = given.into_iter().flatten().collect();
                let found = if given.is_empty() {
                    "none".to_owned()
                } else {
                    given.join(", ")
                };
                return Err(WeightsError::Source { found });
            }
        };
        match config.taxels {
            Some(taxels) if taxels as usize != weights.taxels() => Err(WeightsError::Taxels {
                field,
                found: weights.taxels(),
                taxels: taxels as usize,
            }),
            _ => Ok(weights),
        }
    }
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
