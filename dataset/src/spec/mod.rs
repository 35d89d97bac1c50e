//! Specifications of data sets.

mod build;
mod check;
mod config;
mod draw;
mod error;
mod named;
mod objects;
mod template;
mod timing;

pub use config::{
    DropConfig, FaultsConfig, Label, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin, PressConfig, RecordConfig,
    RecordKind, SkinConfig, SpecConfig, SplitBy, SplitConfig,
};
pub use draw::Draw;
pub use error::SpecError;
pub use named::NAMED_SPECS;
pub(crate) use objects::{Choice, Choices};
pub(crate) use template::Template;
pub(crate) use timing::Timing;

use spts::chain::ChainConfig;
use spts_circuit::RecordingInfo;
use spts_models::{SkinLayout, Streams};
use std::path::{Path, PathBuf};

/// A valid specification: every field is within its range, and all files that it names exist.
///
/// ```
/// use spts_dataset::Spec;
///
/// let spec = Spec::load("random-shapes", &toml::toml! { rows = 5000 })?;
/// assert_eq!((spec.config().rows, spec.skin().taxels()), (5000, 100));
/// let error = Spec::load("random-shapes", &toml::toml! { rows = 0 }).err().expect("no rows");
/// assert!(error.to_string().contains("`rows` = 0 is outside"));
/// # Ok::<(), spts_dataset::SpecError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Spec {
    config: SpecConfig,
    /// The text that was read, with overrides applied, in normal order.
    text: String,
    skin: SkinLayout,
    contact: (String, toml::Table),
    choices: Choices,
    transducer: Template,
    recording: RecordingInfo,
    timing: Timing,
    /// Whether contacts are simulated in time.
    moving: bool,
    rows_per_shard: u64,
    rows_per_shape: u64,
    rows_per_skin: u64,
    /// Folder to which paths are relative.
    folder: PathBuf,
    identity: String,
}

impl Spec {
    /// The specification as written, with defaults filled in.
    #[must_use]
    pub fn config(&self) -> &SpecConfig {
        &self.config
    }

    /// The text of the specification with overrides applied; it is a complete specification.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// SHA-256 of the specification and of the files that it names. Data sets with the same value have the same rows if
    /// the same version of this library made them.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The skin.
    #[must_use]
    pub fn skin(&self) -> &SkinLayout {
        &self.skin
    }

    /// Name and parameters of the contact model.
    #[must_use]
    pub fn contact(&self) -> (&str, &toml::Table) {
        (&self.contact.0, &self.contact.1)
    }

    /// Number of rows in a file; the last file may have fewer.
    #[must_use]
    pub fn rows_per_shard(&self) -> u64 {
        self.rows_per_shard
    }

    /// Number of consecutive rows with the same shape.
    #[must_use]
    pub fn rows_per_shape(&self) -> u64 {
        self.rows_per_shape
    }

    /// Number of consecutive rows with the same skin.
    #[must_use]
    pub fn rows_per_skin(&self) -> u64 {
        self.rows_per_skin
    }

    /// Number of rows of a press or drop.
    #[must_use]
    pub fn windows(&self) -> u64 {
        self.timing.windows
    }

    /// Time from the start of one window to the start of the next, s; `None` if windows follow each other without a
    /// gap.
    #[must_use]
    pub fn interval_s(&self) -> Option<f64> {
        self.timing.interval_s
    }

    /// When windows are recorded.
    pub(crate) fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Whether a ball falls.
    #[must_use]
    pub fn drops(&self) -> bool {
        self.timing.what == RecordKind::Drop
    }

    /// What is never divided between two splits.
    pub(crate) fn split_by(&self) -> SplitBy {
        let procedural = self.choices.are_procedural();
        let files = self.config.object.from == ObjectSource::Meshes && self.most_objects() == 1;
        let usual = if procedural || files {
            SplitBy::Object
        } else {
            SplitBy::Press
        };
        self.config.split.by.unwrap_or(usual)
    }

    /// Whether what is pressed is followed in time, step by step or frame by frame, and not only balanced.
    pub(crate) fn is_moving(&self) -> bool {
        self.moving
    }

    /// Number of files.
    #[must_use]
    pub fn shards(&self) -> u64 {
        self.config.rows.div_ceil(self.rows_per_shard)
    }

    /// Largest number of objects in a press.
    #[must_use]
    pub fn most_objects(&self) -> usize {
        whole(self.config.object.count.range()[1])
    }

    /// Root of the random streams of the data set.
    #[must_use]
    pub fn streams(&self) -> Streams {
        streams(&self.config)
    }

    /// What can be pressed.
    pub(crate) fn choices(&self) -> &Choices {
        &self.choices
    }

    /// Folder that paths are relative to.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Transducer, readout and weights of skin number `skin`, with these faults.
    pub(crate) fn chain_config(&self, skin: u64, faults: &[toml::Table]) -> Result<ChainConfig, SpecError> {
        let transducer = self.transducer.of(streams(&self.config), TRANSDUCER, skin)?;
        chain_config(&self.config, &transducer, faults)
    }

    /// Metadata of the recordings: layout, weights, rate and converter.
    #[must_use]
    pub fn recording(&self) -> &RecordingInfo {
        &self.recording
    }
}

/// Table of a spec with the transducer's parameters.
const TRANSDUCER: &str = "transducer";

/// The chain of `config` with the parameters `transducer`.
fn chain_config(
    config: &SpecConfig,
    transducer: &toml::Table,
    faults: &[toml::Table],
) -> Result<ChainConfig, SpecError> {
    let (transducer, transducer_parameters) = model_of(transducer, TRANSDUCER, spts::chain::DEFAULT_TRANSDUCER)?;
    Ok(ChainConfig {
        transducer: Some(transducer),
        transducer_parameters,
        readout: Some(config.readout.clone()),
        rows: config.weights.clone(),
        weights: None,
        faults: faults.to_vec(),
    })
}

/// Root of the random streams of the data set.
fn streams(config: &SpecConfig) -> Streams {
    Streams::new(config.seed).child("dataset", 0)
}

/// A number that was drawn as a whole one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
pub(crate) fn whole(value: f64) -> usize {
    value.round() as usize
}

/// The entry `model` of `table` and the others.
fn model_of(table: &toml::Table, section: &str, default: &str) -> Result<(String, toml::Table), SpecError> {
    let mut parameters = table.clone();
    match parameters.remove("model") {
        None => Ok((default.to_owned(), parameters)),
        Some(toml::Value::String(model)) => Ok((model, parameters)),
        Some(other) => Err(SpecError::Choice(format!(
            "`{section}.model` = {other}: a text is needed"
        ))),
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
