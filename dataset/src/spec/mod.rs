//! What a data set consists of.

mod check;
mod config;
mod draw;
mod error;
mod named;
mod objects;
mod template;

pub use config::{
    FaultsConfig, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin, PressConfig, RecordConfig, SkinConfig,
    SpecConfig, SplitBy, SplitConfig,
};
pub use draw::Draw;
pub use error::SpecError;
pub use named::NAMED_SPECS;
pub(crate) use objects::{Choice, Choices};
pub(crate) use template::Template;

use check::{check_draws, check_faults, check_name};
use sha2::{Digest as _, Sha256};
use spts::chain::ChainConfig;
use spts_contact::build_contact;
use spts_models::{ConfigError, SkinLayout, Streams, explain_toml, in_range};
use std::path::{Path, PathBuf};

/// Most rows of a data set.
const MOST_ROWS: u64 = 1_000_000_000_000;
/// Most rows of a file.
const MOST_SHARD_ROWS: u64 = 1_000_000;
/// Default rows of a file, least and most, and the share of all rows that it is.
const SHARD_ROWS: [u64; 2] = [100, 10_000];
const SHARDS: u64 = 16;
/// Default rows that share a shape or a skin, before they are a whole number of presses.
const SHARED_ROWS: u64 = 100;
/// Largest spec file, bytes.
const MAX_SPEC_BYTES: u64 = 1 << 21;
/// Contact field of a spec that names none.
const DEFAULT_CONTACT: &str = "footprint";

/// A data set that can be made: every field is within its range, all files that it names are there.
#[derive(Debug, Clone)]
pub struct Spec {
    config: SpecConfig,
    /// The text that was read, its overrides in it, in one order.
    text: String,
    skin: SkinLayout,
    contact: (String, toml::Table),
    choices: Choices,
    transducer: Template,
    rows_per_shard: u64,
    rows_per_shape: u64,
    rows_per_skin: u64,
    /// Folder that paths are relative to.
    folder: PathBuf,
    identity: String,
}

impl Spec {
    /// The spec called `name` in [`NAMED_SPECS`], or in the file `name`, with other values for some of its rows.
    ///
    /// # Errors
    /// [`SpecError`] when there is none, or it is not valid.
    pub fn load(name: &str, overrides: &toml::Table) -> Result<Self, SpecError> {
        if let Some((_, text)) = NAMED_SPECS.iter().find(|(known, _)| *known == name) {
            return Self::from_toml(text, overrides, Path::new("."));
        }
        let path = Path::new(name);
        if path.extension().is_none_or(|e| e != "toml") {
            let known: Vec<&str> = NAMED_SPECS.iter().map(|(name, _)| *name).collect();
            return Err(SpecError::Choice(format!(
                "{name}: is neither a spec file, which ends in `.toml`, nor one of {}",
                known.join(", ")
            )));
        }
        let text = spts_input::read_text(path, MAX_SPEC_BYTES).map_err(|source| SpecError::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        Self::from_toml(&text, overrides, folder).map_err(|error| match error {
            SpecError::Unreadable { .. } | SpecError::Mesh(_) => error,
            error => SpecError::Choice(format!("{name}: {error}")),
        })
    }

    /// The spec that `text` writes, with the top-level values of `overrides` in place of its own; its files are looked
    /// for in `folder`.
    ///
    /// # Errors
    /// [`SpecError`] when it is not valid.
    pub fn from_toml(text: &str, overrides: &toml::Table, folder: &Path) -> Result<Self, SpecError> {
        let mut table: toml::Table =
            toml::from_str(text).map_err(|e| SpecError::Syntax(e.to_string().trim_end().replace('\n', "; ")))?;
        for (key, value) in overrides {
            table.insert(key.clone(), value.clone());
        }
        let written = table.to_string();
        let config: SpecConfig = table.try_into().map_err(|e| SpecError::Syntax(explain_toml(&e)))?;
        Self::new(config, written, folder)
    }

    fn new(mut config: SpecConfig, text: String, folder: &Path) -> Result<Self, SpecError> {
        check_name(&config.name)?;
        let rows = config.rows as f64;
        in_range("rows", rows, (1..=MOST_ROWS).contains(&config.rows), "[1, 10^12]")?;
        in_range(
            "seed",
            config.seed as f64,
            i64::try_from(config.seed).is_ok(),
            "[0, 2^63)",
        )?;
        let windows = config.record.windows;
        in_range(
            "record.windows",
            windows as f64,
            (1..=10_000).contains(&windows),
            "[1, 10000]",
        )?;
        let s = &config.skin;
        let electrode_m = s
            .electrode_m
            .unwrap_or_else(|| SkinLayout::usual_electrode_m(s.pitch_m));
        let skin = SkinLayout::new(s.rows, s.cols, s.pitch_m, electrode_m).map_err(in_skin)?;
        let (model, parameters) = model_of(&config.contact, "contact", DEFAULT_CONTACT)?;
        let mut field = build_contact(&model, parameters.clone(), &skin)?;
        if field.quasi_static().is_none() {
            return Err(SpecError::Choice(format!(
                "`contact.model` = \"{model}\": holds are balanced without dynamics, which \"{DEFAULT_CONTACT}\" alone does"
            )));
        }
        let choices = Choices::new(&config.object, config.pose.about, folder)?;
        let transducer = Template::new(config.transducer.clone());
        let by_default = config
            .rows
            .div_ceil(SHARDS)
            .clamp(SHARD_ROWS[0], SHARD_ROWS[1])
            .next_multiple_of(windows);
        let rows_per_shard = config.rows_per_shard.unwrap_or(by_default);
        let valid = (1..=MOST_SHARD_ROWS).contains(&rows_per_shard);
        in_range("rows_per_shard", rows_per_shard as f64, valid, "[1, 10^6]")?;
        let shared = |rows: Option<u64>| rows.unwrap_or_else(|| SHARED_ROWS.next_multiple_of(windows));
        let rows_per_shape = shared(config.object.rows_per_shape);
        let rows_per_skin = shared(config.skin.rows_per_skin);
        for (field, count) in [
            ("rows_per_shard", rows_per_shard),
            ("object.rows_per_shape", rows_per_shape),
            ("skin.rows_per_skin", rows_per_skin),
        ] {
            if count == 0 || count % windows != 0 {
                return Err(SpecError::Choice(format!(
                    "`{field}` = {count}; valid: whole numbers of presses, which have `record.windows` = {windows} rows"
                )));
            }
        }
        check_draws(&config, &skin)?;
        check_faults(&config)?;
        take_turns(&mut config);
        let mut identity = Sha256::new();
        identity.update(text.as_bytes());
        choices.digest(&mut identity);
        let mut spec = Self {
            skin,
            contact: (model, parameters),
            choices,
            transducer,
            rows_per_shard,
            rows_per_shape,
            rows_per_skin,
            folder: folder.to_owned(),
            text,
            identity: String::new(),
            config,
        };
        // a chain of the first skin shows what transducer, readout and weights are refused for
        let chain = spec.chain_config(0, &[])?;
        let chain = spts::Chain::new(&chain, &spec.skin, 0, folder).map_err(SpecError::chain)?;
        for text in [
            chain.profile_file().map(|f| &f.text),
            chain.seeds_file().map(|f| &f.text),
        ]
        .into_iter()
        .flatten()
        {
            identity.update(text.as_bytes());
        }
        spec.identity = hex(&identity.finalize());
        Ok(spec)
    }

    /// What was written, defaults filled in.
    #[must_use]
    pub fn config(&self) -> &SpecConfig {
        &self.config
    }

    /// The text of the spec, its overrides in it: a spec of its own.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// SHA-256 of the spec and of the files that it names: two data sets with the same one have the same rows, if the
    /// same version of this library made them.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The skin.
    #[must_use]
    pub fn skin(&self) -> &SkinLayout {
        &self.skin
    }

    /// Name and parameters of the contact field.
    #[must_use]
    pub fn contact(&self) -> (&str, &toml::Table) {
        (&self.contact.0, &self.contact.1)
    }

    /// Rows of a file; the last may have fewer.
    #[must_use]
    pub fn rows_per_shard(&self) -> u64 {
        self.rows_per_shard
    }

    /// Consecutive rows that share a shape.
    #[must_use]
    pub fn rows_per_shape(&self) -> u64 {
        self.rows_per_shape
    }

    /// Consecutive rows that share a skin.
    #[must_use]
    pub fn rows_per_skin(&self) -> u64 {
        self.rows_per_skin
    }

    /// Number of files.
    #[must_use]
    pub fn shards(&self) -> u64 {
        self.config.rows.div_ceil(self.rows_per_shard)
    }

    /// Most objects of a press.
    #[must_use]
    pub fn most_objects(&self) -> usize {
        whole(self.config.object.count.range()[1])
    }

    /// Rows of a press, each a window of measurements.
    #[must_use]
    pub fn windows(&self) -> u64 {
        self.config.record.windows
    }

    /// Time from window to window of a press, s; none where they follow each other at once.
    #[must_use]
    pub fn interval_s(&self) -> Option<f64> {
        self.config.record.interval_s
    }

    /// Root of the random streams of the data set.
    #[must_use]
    pub fn streams(&self) -> Streams {
        Streams::new(self.config.seed).child("dataset", 0)
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
        let table = self.transducer.of(self.streams(), "transducer", skin)?;
        let (transducer, transducer_parameters) = model_of(&table, "transducer", spts::chain::DEFAULT_TRANSDUCER)?;
        Ok(ChainConfig {
            transducer: Some(transducer),
            transducer_parameters,
            readout: Some(self.config.readout.clone()),
            rows: self.config.weights.clone(),
            weights: None,
            faults: faults.to_vec(),
        })
    }
}

impl SpecError {
    /// The error of a chain, with the section of a spec in place of a scene's.
    fn chain(error: spts::ChainError) -> Self {
        let message = error.to_string();
        if message.contains("`rows.") {
            Self::Choice(message.replace("`rows.", "`weights."))
        } else {
            Self::Chain(error)
        }
    }
}

/// A number that was drawn as a whole one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
pub(crate) fn whole(value: f64) -> usize {
    value.round() as usize
}

fn in_skin(error: ConfigError) -> ConfigError {
    ConfigError {
        field: format!("skin.{}", error.field),
        ..error
    }
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

/// Gives the grids of presses and those of skins their turns.
fn take_turns(config: &mut SpecConfig) {
    let (pose, press) = (&mut config.pose, &mut config.press);
    let mut turn = 1;
    for draw in [
        &mut config.object.count,
        &mut pose.x_share,
        &mut pose.y_share,
        &mut pose.x_m,
        &mut pose.y_m,
        &mut pose.rotation_deg,
        &mut pose.tilt_x_deg,
        &mut pose.tilt_y_deg,
        &mut press.force_n,
        &mut press.hold_s,
        &mut config.skin.presses_before,
    ] {
        draw.take_turn(&mut turn);
    }
    if let Some(stiffness) = &mut press.stiffness_pa_per_m {
        stiffness.take_turn(&mut turn);
    }
    let mut turn = 1;
    config.faults.count.take_turn(&mut turn);
    if let Some(seed) = &mut config.skin.seed {
        seed.take_turn(&mut turn);
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
