//! Section `[rows]`: where the rows of the sensing matrix come from.

use super::error::ChainError;
use serde::{Deserialize, Serialize};
use spts_circuit::{CompressiveWeights, Mode, Profile, Seeding, parse_seeds};
use spts_models::{SkinLayout, in_section};
use std::path::{Path, PathBuf};

/// Section `[rows]` of a scene: the weights of the compressive readout. What is given here takes the place of what the
/// readout profile says; at most one of `seeding`, `seeds` and `seeds_file` is.
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
    /// Rule by which the cells are seeded: `"address"` or `"mixed"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeding: Option<Seeding>,
    /// Seed of every cell, row by row; each [0, 2^32).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds: Option<Vec<u32>>,
    /// File of such seeds, relative to the scene file, as [`parse_seeds`] reads it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds_file: Option<String>,
    /// Levels of the cells: `"binary"`, ±1, or `"analog"`, eight bits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub levels: Option<CompressiveWeights>,
}

/// File that the seeds were read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeedsFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl RowsConfig {
    /// Whether the readout profile alone says where the rows come from.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// `profile` with these rows on a skin with this `layout`, and the file that they were read from.
    ///
    /// # Errors
    /// [`ChainError::Rows`] for more than one source of seeds, a file that holds no seeds, and seeds of another number
    /// of taxels;
    /// [`ChainError::SeedsFile`] for a file that cannot be read.
    pub(super) fn applied(
        &self,
        mut profile: Profile,
        layout: &SkinLayout,
        folder: &Path,
    ) -> Result<(Profile, Option<SeedsFile>), ChainError> {
        let given = [
            self.seeding.is_some().then_some("`rows.seeding`"),
            self.seeds.is_some().then_some("`rows.seeds`"),
            self.seeds_file.is_some().then_some("`rows.seeds_file`"),
        ];
        let given: Vec<&str> = given.into_iter().flatten().collect();
        if given.len() > 1 {
            return Err(ChainError::Rows(format!(
                "only one of {} may be given",
                given.join(" and ")
            )));
        }
        let file = self
            .seeds_file
            .as_deref()
            .map(|name| SeedsFile::read(name, folder))
            .transpose()?;
        let seeds = match (&self.seeds, &file) {
            (Some(seeds), _) => Some(checked(seeds.clone(), "`rows.seeds`", layout)?),
            (None, Some(file)) => Some(checked(file.seeds()?, &file.source(), layout)?),
            (None, None) => None,
        };
        if !given.is_empty() {
            profile.seeding = self.seeding.unwrap_or_default();
            profile.seeds = seeds;
            profile.patterns = None;
        }
        if let Some(levels) = self.levels {
            profile.weights = levels;
            let taxels = u32::try_from(layout.taxels()).unwrap_or(u32::MAX);
            let weights = profile.weights(Mode::Compressive, taxels);
            weights.map_err(|error| ChainError::Rows(in_section("rows.levels", &error.to_string())))?;
        }
        Ok((profile, file))
    }
}

/// `seeds`, which `source` gives, if there are as many as taxels.
fn checked(seeds: Vec<u32>, source: &str, layout: &SkinLayout) -> Result<Vec<u32>, ChainError> {
    let (rows, cols) = (layout.rows(), layout.cols());
    if seeds.len() == layout.taxels() {
        return Ok(seeds);
    }
    let (found, taxels) = (seeds.len(), layout.taxels());
    Err(ChainError::Rows(format!(
        "{source}: number of seeds = {found}; valid: {taxels}, one for each taxel of {rows} × {cols}"
    )))
}

impl SeedsFile {
    fn read(name: &str, folder: &Path) -> Result<Self, ChainError> {
        let path = folder.join(name);
        match spts_input::read_text(&path, spts_circuit::MAX_SEEDS_BYTES) {
            Ok(text) => Ok(Self { path, text }),
            Err(error) => Err(ChainError::SeedsFile {
                path,
                source: error.into(),
            }),
        }
    }

    /// The file and the field that names it, for messages.
    fn source(&self) -> String {
        format!("{}: `rows.seeds_file`", self.path.display())
    }

    fn seeds(&self) -> Result<Vec<u32>, ChainError> {
        parse_seeds(&self.text).map_err(|error| ChainError::Rows(format!("{}: {error}", self.source())))
    }
}
