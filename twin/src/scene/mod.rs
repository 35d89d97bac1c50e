//! Scenes: everything from the press to the recording, read from a TOML file or built in code. A [`Scene`] is valid by
//! construction.
//!
//! ```toml
//! seed = 7
//! readout = "as_built"
//! [transducer_parameters]
//! exponent = 0.6
//! [[faults]]
//! name = "dead"
//! taxel = 44
//! [press]
//! object = "T"
//! force_n = 20.0
//! presses = 10
//! ```

mod assign;
mod config;
#[cfg(test)]
mod tests;

pub use crate::assign::Assignment;
pub use crate::chain::RowsConfig;
pub use config::SceneConfig;
pub use spts_sim::fidelity::Tolerance;
pub use spts_sim::mechanics::{BendConfig, DropConfig, Mechanics, MechanicsConfig, PressConfig, Task, Timestep};

use crate::chain::{Chain, DEFAULT_READOUT, DEFAULT_TRANSDUCER, DEFAULT_WEIGHTS, read_gains};
use crate::provenance::hash_text;
use crate::session::{NAMES, is_plain};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::path::Path;
use std::sync::OnceLock;

/// A valid scene: the mechanics, and the chain of transducer, readout and weights that follows them.
///
/// ```
/// use spts::scene::Scene;
///
/// let scene = Scene::from_toml("readout = \"ideal\"\n[press]\nobject = \"T\"\nforce_n = 12", ".".as_ref())?;
/// assert_eq!(scene.name(), "T");
///
/// // what is wrong ends in an error that names the field
/// let error = Scene::from_toml("[transducer_parameters]\ntemperature_c = 900\n[drop]", ".".as_ref()).unwrap_err();
/// assert!(error.to_string().contains("`transducer_parameters.temperature_c` = 900"));
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scene {
    config: SceneConfig,
    mechanics: Mechanics,
    chain: Chain,
    /// Hash of the scene, once it has been asked for.
    hash: OnceLock<String>,
}

impl Scene {
    /// The scene that `config` describes. Files that it names are looked up in `folder`.
    ///
    /// # Errors
    /// [`Refusal`] for the first field that is not valid.
    pub fn new(mut config: SceneConfig, folder: &Path) -> Result<Self, Refusal> {
        read_gains(&mut config.transducer_parameters, folder)?;
        let mechanics = Mechanics::new(config.mechanics(), folder)?;
        let chain = Chain::new(&config.chain(), mechanics.skin(), config.seed, folder)?;
        for (value, default) in [
            (&mut config.transducer, DEFAULT_TRANSDUCER),
            (&mut config.readout, DEFAULT_READOUT),
            (&mut config.weights, DEFAULT_WEIGHTS),
        ] {
            value.get_or_insert_with(|| default.to_owned());
        }
        let mut config = config.with_mechanics(mechanics.config().clone());
        let name = default_name(&config);
        let name = config.name.get_or_insert(name);
        if !is_plain(name) {
            return Err(Refusal::range("name", format!("{name:?}"), NAMES));
        }
        Ok(Self { config, mechanics, chain, hash: OnceLock::new() })
    }

    /// The scene in the TOML text `text`. Files that it names are looked up in `folder`.
    ///
    /// # Errors
    /// [`Refusal`] if the text is not TOML, or the scene is not valid.
    pub fn from_toml(text: &str, folder: &Path) -> Result<Self, Refusal> {
        Self::new(SceneConfig::from_toml(text)?, folder)
    }

    /// Reads a scene file. Relative paths in the scene start from the folder of that file. A scene without a name takes
    /// the file's.
    ///
    /// # Errors
    /// [`Refusal`], with the path of the file, if the file cannot be read, is not TOML, or its scene is not
    /// valid.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Refusal> {
        let path = path.as_ref();
        let read = || {
            let text = spts_input::read_text(path, crate::chain::MAX_TOML_BYTES);
            let text = text.map_err(|error| Refusal::from_error(error).at("cannot be read"))?;
            let mut config = SceneConfig::from_toml(&text)?;
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            config.name.get_or_insert_with(|| stem.into_owned());
            Self::new(config, path.parent().unwrap_or(Path::new("")))
        };
        read().map_err(|error: Refusal| error.at(path.display()))
    }

    /// Ten presses of the object called `name` by the arm, at the place of the published recordings. Everything else
    /// has its default.
    ///
    /// # Errors
    /// [`Refusal`] if there is no object of that name.
    pub fn press(name: &str) -> Result<Self, Refusal> {
        Self::new(MechanicsConfig::press(name).into(), Path::new(""))
    }

    /// Ten drops of a tennis ball from half a metre onto the middle of the skin. Everything else has its default.
    ///
    /// # Errors
    /// None, with the defaults as they are.
    pub fn bounce() -> Result<Self, Refusal> {
        Self::new(MechanicsConfig::bounce().into(), Path::new(""))
    }

    /// The configuration, with all defaults filled in.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// The mechanics, from which a [`World`](spts_sim::World) is built.
    pub fn mechanics(&self) -> &Mechanics {
        &self.mechanics
    }

    /// Transducer, readout and weights.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Name of the recorded session.
    pub fn name(&self) -> &str {
        self.config.name.as_deref().unwrap_or_default()
    }

    /// Class of the session, that is what is pressed or dropped: the name of the object, the name of the scene for a
    /// mesh, or `ball`.
    pub fn object(&self) -> &str {
        match self.task() {
            Task::Press(press) => press.object.as_deref().unwrap_or(self.name()),
            Task::Drop(_) => "tennis",
        }
    }

    /// Whether the scene presses or drops, with the parameters.
    pub fn task(&self) -> Task<'_> {
        self.mechanics.task()
    }

    /// Number of presses or drops.
    pub fn repeats(&self) -> usize {
        self.mechanics.repeats()
    }

    /// Length of one press or drop, s.
    pub fn duration_s(&self) -> f64 {
        self.mechanics.duration_s()
    }

    /// The skin.
    pub fn skin(&self) -> &SkinLayout {
        self.mechanics.skin()
    }

    /// Root of every random number.
    pub fn seed(&self) -> u64 {
        self.config.seed
    }

    /// The scene as TOML, with all defaults filled in. Reading it back gives the same scene.
    ///
    /// # Errors
    /// [`Refusal`], which no valid scene should cause.
    pub fn to_toml(&self) -> Result<String, Refusal> {
        toml::to_string(&self.config).map_err(unwritable)
    }

    /// Hash of the scene: of its TOML text, and of the contents of its mesh, profile and seed files, whatever these
    /// files are called.
    ///
    /// # Errors
    /// As [`Scene::to_toml`].
    pub fn hash(&self) -> Result<String, Refusal> {
        if let Some(hash) = self.hash.get() {
            return Ok(hash.clone());
        }
        let mut bytes = toml::to_string(&self.portable()).map_err(unwritable)?.into_bytes();
        let mesh = self.mechanics.mesh();
        for value in mesh.vertices.iter().flatten() {
            bytes.extend(value.to_le_bytes());
        }
        for index in mesh.triangles.iter().flatten() {
            bytes.extend(index.to_le_bytes());
        }
        let texts = [self.chain.profile_file().map(|file| &file.text), self.chain.rows_file().map(|file| &file.text)];
        bytes.extend(texts.into_iter().flatten().flat_map(|text| text.bytes()));
        Ok(self.hash.get_or_init(|| hash_text(&bytes)).clone())
    }

    /// The configuration with all defaults filled in. Files are named [`MESH_COPY`] (with the extension of the mesh),
    /// [`READOUT_COPY`], [`SEEDS_COPY`] and [`PATTERNS_COPY`]. It is written beside the results, together with copies
    /// of these files.
    pub(crate) fn portable(&self) -> SceneConfig {
        let mut config = self.config.clone();
        if self.chain.profile_file().is_some() {
            config.readout = Some(READOUT_COPY.to_owned());
        }
        if let Some(file) = &mut config.rows.seeds_file {
            SEEDS_COPY.clone_into(file);
        }
        if let Some(file) = &mut config.rows.patterns_file {
            PATTERNS_COPY.clone_into(file);
        }
        if let Some(mesh) = config.press.as_mut().and_then(|press| press.mesh.as_mut()) {
            let extension = Path::new(&*mesh).extension().unwrap_or_default();
            *mesh = format!("{MESH_COPY}.{}", extension.to_string_lossy().to_ascii_lowercase());
        }
        config
    }
}

/// Name of the copy of a mesh, without its extension.
pub const MESH_COPY: &str = "mesh";
/// Name of the copy of a profile file.
pub(crate) const READOUT_COPY: &str = "readout.toml";
/// Name of the copy of a file of seeds.
pub(crate) const SEEDS_COPY: &str = "seeds.txt";
/// Name of the copy of a pattern file.
pub(crate) const PATTERNS_COPY: &str = "patterns.txt";

/// The error of a scene that has no TOML.
pub(crate) fn unwritable(error: toml::ser::Error) -> Refusal {
    Refusal::from_error(error).at("cannot be written")
}

/// The error of a file whose name cannot stand in a scene.
pub(crate) fn not_text(file: &Path) -> Refusal {
    Refusal::new("the name of the file is not valid UTF-8").at(file.display())
}

/// Name of a scene that has none: of its object, of its mesh file, or `bounce`.
fn default_name(config: &SceneConfig) -> String {
    let Some(press) = &config.press else {
        return "bounce".to_owned();
    };
    let mesh = press.mesh.as_deref().map(|file| {
        let stem = Path::new(file).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    });
    let several = || match press.objects.len() {
        count @ 0..=3 => press.objects[..count].iter().map(|entry| entry.object.as_str()).collect::<Vec<_>>().join("-"),
        count => format!("{count}-objects"),
    };
    press.object.clone().or(mesh).unwrap_or_else(several)
}
