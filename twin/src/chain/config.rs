//! Transducer, readout, rows and weights as a scene writes them, and the files that it names.

use serde::{Deserialize, Serialize};
use spts_circuit::{CompressiveWeights, Mode, Patterns, Profile, Seeding, WireConfig, parse_patterns, parse_seeds};
use spts_input::Refusal;
use spts_models::{SkinLayout, TaxelGains, in_section};
use std::path::{Path, PathBuf};

/// Size of the largest scene or readout profile that is read, bytes. The limit keeps parsing small, because a parsed
/// file takes some hundred times its size. The seeds of 100,000 taxels fill 1 MB; larger skins name a file of seeds.
pub const MAX_TOML_BYTES: u64 = 1 << 21;

/// Every stage between the pressure on the skin and the recording, as a scene writes it. A missing field takes its
/// default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChainConfig {
    /// Name of the transducer in [`TRANSDUCERS`](spts_models::TRANSDUCERS). Default [`DEFAULT_TRANSDUCER`].
    pub transducer: Option<String>,
    /// Parameters of the transducer. Default: none given, so each takes its own default.
    pub transducer_parameters: toml::Table,
    /// Readout profile: a name in [`PROFILES`](spts_circuit::PROFILES), or a file that ends in `.toml`. Default
    /// [`DEFAULT_READOUT`].
    pub readout: Option<String>,
    /// The readout profile itself, in place of `readout`. Default: none.
    pub profile: Option<Profile>,
    /// Seeds and levels of the cells. Default: those of the profile.
    pub rows: RowsConfig,
    /// Source of the weights, a name in [`WEIGHT_SOURCES`]. Default
    /// [`DEFAULT_WEIGHTS`].
    pub weights: Option<String>,
    /// Faulty cells, added to those of the profile: `name`, `taxel` and the fault's parameters. Default: none.
    pub faults: Vec<toml::Table>,
    /// Wires, in place of those of the profile. Default: none said.
    pub wires: Vec<WireConfig>,
}

/// Transducer of a scene that names none.
pub const DEFAULT_TRANSDUCER: &str = "velostat";
/// Readout profile of a scene that names none.
pub const DEFAULT_READOUT: &str = "as_built";

/// Where the weights of the taxels in a recording come from: a formula, or emulated cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WeightSource {
    /// Computed by the formula of the cells' generator.
    Model,
    /// The codes of emulated cells that run the shipped firmware: [`FirmwareCells`](super::FirmwareCells).
    Firmware,
}

/// Every source of weights, with the name that a scene gives to it.
pub const WEIGHT_SOURCES: &[(&str, WeightSource)] =
    &[("model", WeightSource::Model), ("firmware", WeightSource::Firmware)];

/// Source of a scene that names none.
pub const DEFAULT_WEIGHTS: &str = "model";

impl WeightSource {
    /// The source called `name` in [`WEIGHT_SOURCES`].
    ///
    /// # Errors
    /// [`Refusal`] if the table has no such name.
    pub fn named(name: &str) -> Result<Self, Refusal> {
        let found = WEIGHT_SOURCES.iter().find(|(known, _)| *known == name);
        found.map(|(_, source)| *source).ok_or_else(|| {
            let known: Vec<&str> = WEIGHT_SOURCES.iter().map(|(known, _)| *known).collect();
            let known = known.join(", ");
            Refusal::new(format!("`weights` = \"{name}\" is not a source of weights; known: {known}"))
        })
    }
}

/// The file from which a readout profile was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl ProfileFile {
    /// The file that `readout` names, in `folder`; `None` when it is the name of a profile.
    pub(super) fn of(readout: &str, folder: &Path) -> Result<Option<Self>, Refusal> {
        if Path::new(readout).extension().is_none_or(|e| e != "toml") {
            return Ok(None);
        }
        let path = folder.join(readout);
        match spts_input::read_text(&path, MAX_TOML_BYTES) {
            Ok(text) => Ok(Some(Self { path, text })),
            Err(error) => Err(Refusal::in_file(&path)(error).at("`readout`")),
        }
    }
}

/// Parameter of the transducer that may name a file.
const GAINS: &str = "gains";

/// Replaces the file name in `gains` of the transducer's `parameters` by the gains in that file. A relative name is
/// looked up in `folder`. A scene stored afterwards no longer needs the file.
///
/// # Errors
/// [`Refusal`] if the file cannot be read or holds no gains.
pub fn read_gains(parameters: &mut toml::Table, folder: &Path) -> Result<(), Refusal> {
    let Some(toml::Value::String(name)) = parameters.get(GAINS) else {
        return Ok(());
    };
    let path = folder.join(name);
    let refused = |reason: String| Refusal::new(format!("`gains`: {}: {reason}", path.display()));
    let text = spts_input::read_text(&path, MAX_TOML_BYTES).map_err(|error| refused(error.to_string()))?;
    let gains = TaxelGains::from_toml(&text).map_err(&refused)?;
    let value = toml::Value::try_from(&gains).map_err(|error| refused(error.to_string()))?;
    parameters.insert(GAINS.to_owned(), value);
    Ok(())
}

/// Section `[rows]` of a scene: the weights of the compressive readout. A field given here replaces the one in the
/// readout profile. At most one of `seeding`, `seeds`, `seeds_file`, `patterns` and `patterns_file` may be given.
///
/// ```
/// use spts::scene::Scene;
///
/// let scene = "[rows]\nseeding = \"mixed\"\nlevels = \"analog\"\n[press]\nobject = \"T\"";
/// let scene = Scene::from_toml(scene, ".".as_ref())?;
/// assert_eq!(scene.chain().profile().seeding, Some(spts_circuit::Seeding::Mixed));
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RowsConfig {
    /// Kind of the rows: from the cells' generators, or a repeated pattern. Default: the kind that the other fields
    /// imply.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<RowsKind>,
    /// Rule that seeds the cells: `"address"` or `"mixed"`. Default: that of the profile, else [`Seeding::usual`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeding: Option<Seeding>,
    /// Seed of every cell, row by row; each [0, 2^32).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds: Option<Vec<u32>>,
    /// File with such seeds, relative to the scene file, in the format of [`parse_seeds`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds_file: Option<String>,
    /// Levels of the weights: `"binary"` (±1) or `"analog"` (eight bits).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<CompressiveWeights>,
    /// File with a pattern, relative to the scene file, in the format of [`parse_patterns`]: one row a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patterns_file: Option<String>,
    /// The pattern itself: `period` rows of `codes`, one row after the other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patterns: Option<Patterns>,
}

/// How the cells form their rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowsKind {
    /// By their pseudorandom generators.
    Generator,
    /// By a pattern that repeats.
    Pattern,
}

/// The file from which seeds or a pattern were read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowsFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// Key of the scene that names the file.
    field: &'static str,
}

impl RowsConfig {
    /// Whether the section is empty, so that the readout profile alone determines the rows.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// `profile` with these rows on a skin with this `layout`, and the file that they were read from.
    ///
    /// # Errors
    /// [`Refusal`] for more than one source of rows or one of another kind, a file that holds none or cannot be read,
    /// and rows of another number of taxels.
    pub(super) fn applied(
        &self,
        mut profile: Profile,
        layout: &SkinLayout,
        folder: &Path,
    ) -> Result<(Profile, Option<RowsFile>), Refusal> {
        let source = self.source()?;
        let file = self.file(folder)?;
        if source.is_some() {
            profile.seeding = self.seeding;
            (profile.seeds, profile.patterns) = (None, None);
        }
        let in_file = || file.as_ref().map_or_else(String::new, RowsFile::source);
        match source {
            Some((SEEDS, _)) => profile.seeds = self.seeds.clone(),
            Some((SEEDS_FILE, _)) => profile.seeds = file.as_ref().map(RowsFile::seeds).transpose()?,
            Some((PATTERNS, _)) => profile.patterns.clone_from(&self.patterns),
            Some((PATTERNS_FILE, _)) => profile.patterns = file.as_ref().map(RowsFile::patterns).transpose()?,
            _ => {}
        }
        let given = match source {
            Some((field @ (SEEDS | PATTERNS), _)) => format!("`rows.{field}`"),
            _ => in_file(),
        };
        if source.is_some() {
            check_number(profile.seeds.as_ref().map(Vec::len), "seeds", &given, layout)?;
            let taxels = profile.patterns.as_ref().map(Patterns::taxels);
            check_number(taxels, "taxels of a row", &given, layout)?;
        }
        match (self.kind, &profile.patterns) {
            (Some(RowsKind::Generator), Some(_)) => profile.patterns = None,
            (Some(RowsKind::Pattern), None) => {
                let message = "`rows.kind` = \"pattern\" needs `rows.patterns_file` or `rows.patterns`";
                return Err(Refusal::new(message));
            }
            _ => {}
        }
        if let Some(levels) = self.levels {
            profile.weights = levels;
        }
        profile = profile.seeded(layout);
        if self.levels.is_some() || profile.patterns.is_some() && source.is_some() {
            let taxels = u32::try_from(layout.taxels()).unwrap_or(u32::MAX);
            let weights = profile.weights(Mode::Compressive, taxels);
            let section = if self.levels.is_some() { "rows.levels" } else { "rows" };
            weights.map_err(|error| Refusal::new(in_section(section, &error.to_string())))?;
        }
        Ok((profile, file))
    }

    /// The key that says which rows, and the kind of them.
    fn source(&self) -> Result<Option<(&'static str, RowsKind)>, Refusal> {
        let given = [
            (self.seeding.is_some(), SEEDING, RowsKind::Generator),
            (self.seeds.is_some(), SEEDS, RowsKind::Generator),
            (self.seeds_file.is_some(), SEEDS_FILE, RowsKind::Generator),
            (self.patterns.is_some(), PATTERNS, RowsKind::Pattern),
            (self.patterns_file.is_some(), PATTERNS_FILE, RowsKind::Pattern),
        ];
        let given: Vec<(&str, RowsKind)> = given.into_iter().filter(|g| g.0).map(|g| (g.1, g.2)).collect();
        if given.len() > 1 {
            let names: Vec<String> = given.iter().map(|(field, _)| format!("`rows.{field}`")).collect();
            let names = names.join(" and ");
            return Err(Refusal::new(format!("only one of {names} may be given")));
        }
        match (given.first(), self.kind) {
            (Some((field, kind)), Some(asked)) if *kind != asked => {
                let kind = if asked == RowsKind::Pattern { "pattern" } else { "generator" };
                Err(Refusal::new(format!("`rows.{field}` does not go with `rows.kind` = \"{kind}\"")))
            }
            (source, _) => Ok(source.copied()),
        }
    }

    /// The file that is named, read.
    fn file(&self, folder: &Path) -> Result<Option<RowsFile>, Refusal> {
        let (name, field, most) = match (&self.seeds_file, &self.patterns_file) {
            (Some(name), _) => (name, SEEDS_FILE, spts_circuit::MAX_SEEDS_BYTES),
            (None, Some(name)) => (name, PATTERNS_FILE, spts_circuit::MAX_PATTERNS_BYTES),
            (None, None) => return Ok(None),
        };
        let path = folder.join(name);
        match spts_input::read_text(&path, most) {
            Ok(text) => Ok(Some(RowsFile { path, text, field })),
            Err(error) => Err(Refusal::in_file(&path)(error).at(format!("`rows.{field}`"))),
        }
    }
}

// keys of the section
const SEEDING: &str = "seeding";
const SEEDS: &str = "seeds";
const SEEDS_FILE: &str = "seeds_file";
const PATTERNS: &str = "patterns";
const PATTERNS_FILE: &str = "patterns_file";

/// Checks that there are as many of `what`, which `source` gives, as taxels.
fn check_number(found: Option<usize>, what: &str, source: &str, layout: &SkinLayout) -> Result<(), Refusal> {
    let (rows, cols, taxels) = (layout.rows(), layout.cols(), layout.taxels());
    match found {
        Some(found) if found != taxels => Err(Refusal::new(format!(
            "{source}: number of {what} = {found}; valid: {taxels}, one for each taxel of {rows} × {cols}"
        ))),
        _ => Ok(()),
    }
}

impl RowsFile {
    /// The file and the field that names it, for messages.
    fn source(&self) -> String {
        format!("{}: `rows.{}`", self.path.display(), self.field)
    }

    fn seeds(&self) -> Result<Vec<u32>, Refusal> {
        parse_seeds(&self.text).map_err(|error| Refusal::new(format!("{}: {error}", self.source())))
    }

    fn patterns(&self) -> Result<Patterns, Refusal> {
        parse_patterns(&self.text).map_err(|error| Refusal::new(format!("{}: {error}", self.source())))
    }
}
