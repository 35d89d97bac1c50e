//! Section `[rows]` of a scene: where the rows of the sensing matrix come from.

use super::error::ChainError;
use serde::{Deserialize, Serialize};
use spts_circuit::{CompressiveWeights, Mode, Patterns, Profile, Seeding, parse_patterns, parse_seeds};
use spts_models::{SkinLayout, in_section};
use std::path::{Path, PathBuf};

/// Section `[rows]` of a scene: the weights of the compressive readout. A field given here replaces the one in the
/// readout profile. At most one of `seeding`, `seeds`, `seeds_file`, `patterns` and `patterns_file` may be given.
///
/// ```
/// use spts::scene::Scene;
///
/// let scene = "[rows]\nseeding = \"mixed\"\nlevels = \"analog\"\n[press]\nobject = \"T\"";
/// let scene = Scene::from_toml(scene, ".".as_ref())?;
/// assert_eq!(scene.chain().profile().seeding, spts_circuit::Seeding::Mixed);
/// # Ok::<(), spts::scene::SceneError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RowsConfig {
    /// Kind of the rows: from the cells' generators, or a repeated pattern. Default: the kind that the other fields
    /// imply.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<RowsKind>,
    /// Rule that seeds the cells: `"address"` or `"mixed"`.
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
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// `profile` with these rows on a skin with this `layout`, and the file that they were read from.
    ///
    /// # Errors
    /// [`ChainError::Rows`] for more than one source of rows or one of another kind, a file that holds none, and rows
    /// of another number of taxels; [`ChainError::RowsFile`] for a file that cannot be read.
    pub(super) fn applied(
        &self,
        mut profile: Profile,
        layout: &SkinLayout,
        folder: &Path,
    ) -> Result<(Profile, Option<RowsFile>), ChainError> {
        let source = self.source()?;
        let file = self.file(folder)?;
        if source.is_some() {
            profile.seeding = self.seeding.unwrap_or_default();
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
                return Err(ChainError::Rows(message.to_owned()));
            }
            _ => {}
        }
        if let Some(levels) = self.levels {
            profile.weights = levels;
        }
        if self.levels.is_some() || profile.patterns.is_some() && source.is_some() {
            let taxels = u32::try_from(layout.taxels()).unwrap_or(u32::MAX);
            let weights = profile.weights(Mode::Compressive, taxels);
            let section = if self.levels.is_some() { "rows.levels" } else { "rows" };
            weights.map_err(|error| ChainError::Rows(in_section(section, &error.to_string())))?;
        }
        Ok((profile, file))
    }

    /// The key that says which rows, and the kind of them.
    fn source(&self) -> Result<Option<(&'static str, RowsKind)>, ChainError> {
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
            return Err(ChainError::Rows(format!("only one of {names} may be given")));
        }
        match (given.first(), self.kind) {
            (Some((field, kind)), Some(asked)) if *kind != asked => {
                let kind = if asked == RowsKind::Pattern {
                    "pattern"
                } else {
                    "generator"
                };
                Err(ChainError::Rows(format!(
                    "`rows.{field}` does not go with `rows.kind` = \"{kind}\""
                )))
            }
            (source, _) => Ok(source.copied()),
        }
    }

    /// The file that is named, read.
    fn file(&self, folder: &Path) -> Result<Option<RowsFile>, ChainError> {
        let (name, field, most) = match (&self.seeds_file, &self.patterns_file) {
            (Some(name), _) => (name, SEEDS_FILE, spts_circuit::MAX_SEEDS_BYTES),
            (None, Some(name)) => (name, PATTERNS_FILE, spts_circuit::MAX_PATTERNS_BYTES),
            (None, None) => return Ok(None),
        };
        let path = folder.join(name);
        match spts_input::read_text(&path, most) {
            Ok(text) => Ok(Some(RowsFile { path, text, field })),
            Err(error) => Err(ChainError::RowsFile {
                field,
                path,
                source: error.into(),
            }),
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
fn check_number(found: Option<usize>, what: &str, source: &str, layout: &SkinLayout) -> Result<(), ChainError> {
    let (rows, cols, taxels) = (layout.rows(), layout.cols(), layout.taxels());
    match found {
        Some(found) if found != taxels => Err(ChainError::Rows(format!(
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

    fn seeds(&self) -> Result<Vec<u32>, ChainError> {
        parse_seeds(&self.text).map_err(|error| ChainError::Rows(format!("{}: {error}", self.source())))
    }

    fn patterns(&self) -> Result<Patterns, ChainError> {
        parse_patterns(&self.text).map_err(|error| ChainError::Rows(format!("{}: {error}", self.source())))
    }
}
