//! A specification as written in TOML: every section and its defaults.

mod record;
mod skin;
mod touch;

pub use record::{Label, RecordConfig, RecordKind};
pub use skin::{FaultsConfig, SkinConfig};
pub use touch::{DropConfig, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin, PressConfig};

use serde::Deserialize;
use spts::chain::RowsConfig;

/// The specification of a data set, as written in TOML.
///
/// A field documented as a draw may be a number or a distribution ([`Draw`](super::Draw)). Draws in `[object]` are made
/// once for every shape; those in `[transducer]`, in `[faults]` and of `skin.seed` once for every skin; all others once
/// for every press.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpecConfig {
    /// Name of the data set: letters, digits, `-` and `_`. Default "touches".
    pub name: String,
    /// Description in a sentence or two, for the data set's card. Default: none.
    pub description: String,
    /// Number of rows; [1, 10^12]. Default 1000.
    pub rows: u64,
    /// Number of rows in a file; [1, 10^6], a whole number of presses. Default: a sixteenth of all rows, but at least
    /// 100 and at most 10,000.
    pub rows_per_shard: Option<u64>,
    /// Root of every random number; [0, 2^63). Default 0.
    pub seed: u64,
    /// Readout profile: a name, or a file that ends in `.toml`, relative to the specification. Default "as_built".
    pub readout: String,
    /// Division into training, validation and tests.
    pub split: SplitConfig,
    /// The objects.
    pub object: ObjectConfig,
    /// Where the objects lie, and at which angles.
    pub pose: PoseConfig,
    /// Force and duration of presses.
    pub press: PressConfig,
    /// The ball and its fall; only if `record.what` is "drop".
    pub drop: Option<DropConfig>,
    /// Contact model: its name, `model`, and its parameters. Default: `footprint`, and `winkler` for drops.
    pub contact: toml::Table,
    /// The skin.
    pub skin: SkinConfig,
    /// Transducer: `model` and its parameters; a parameter may be a draw. Default: `velostat`.
    pub transducer: toml::Table,
    /// Rows of the sensing matrix, as in a scene's `[rows]`.
    pub weights: RowsConfig,
    /// Faulty cells.
    pub faults: FaultsConfig,
    /// What is recorded.
    pub record: RecordConfig,
}

/// Section `[split]`: shares of the data for validation and tests.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SplitConfig {
    /// What is never divided between two splits: a shape or a press. Default: a shape for procedural shapes and mesh
    /// files, a press for the seventeen objects.
    pub by: Option<SplitBy>,
    /// Share for validation; [0, 1]. Default 0.1.
    pub validation: f64,
    /// Share for tests; [0, 1]. Default 0.1.
    pub test: f64,
}

/// What is never divided between two splits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// All touches of one shape: tests use shapes that are not in the training data.
    Object,
    /// All windows of one press.
    Press,
}

impl Default for SpecConfig {
    fn default() -> Self {
        Self {
            name: "touches".to_owned(),
            description: String::new(),
            rows: 1000,
            rows_per_shard: None,
            seed: 0,
            readout: spts::chain::DEFAULT_READOUT.to_owned(),
            split: SplitConfig::default(),
            object: ObjectConfig::default(),
            pose: PoseConfig::default(),
            press: PressConfig::default(),
            drop: None,
            contact: toml::Table::new(),
            skin: SkinConfig::default(),
            transducer: toml::Table::new(),
            weights: RowsConfig::default(),
            faults: FaultsConfig::default(),
            record: RecordConfig::default(),
        }
    }
}

impl Default for SplitConfig {
    fn default() -> Self {
        Self {
            by: None,
            validation: 0.1,
            test: 0.1,
        }
    }
}
