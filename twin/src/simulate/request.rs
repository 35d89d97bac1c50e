//! From what the command line says to a valid scene that can be written down and run again.

use super::error::SimulateError;
use crate::chain::{Chain, DEFAULT_READOUT, DEFAULT_TRANSDUCER, DEFAULT_WEIGHTS, TwinError};
use crate::provenance::hash_text;
use serde::de::DeserializeOwned;
use spts_circuit::Profile;
use spts_sim::ladder::change_model;
use spts_sim::mesh::MeshReport;
use spts_sim::scene::{DropConfig, PressConfig, Scene, SceneConfig, SceneError, Task, Timestep};
use std::path::{Path, PathBuf};

/// A scene as asked for: its name or file, and what to change in it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// `press/NAME`, `press` (with a mesh), `bounce`, or a file that ends in `.toml`.
    pub scene: String,
    /// Mesh file in place of the object.
    pub mesh: Option<PathBuf>,
    /// Metres per unit of the mesh file.
    pub scale: Option<f64>,
    /// Row of the object's origin, or of the landing point, in taxels.
    pub row: Option<f64>,
    /// Column of it, in taxels.
    pub col: Option<f64>,
    /// Rotation about the skin's normal, degrees.
    pub rotation_deg: Option<f64>,
    /// Tilt about the skin's x and y axes, degrees.
    pub tilt_deg: Option<[f64; 2]>,
    /// Force on the plateau, N.
    pub force_n: Option<f64>,
    /// Height of a drop, m.
    pub height_m: Option<f64>,
    /// Number of presses or drops; a scene without a file has one by default.
    pub presses: Option<usize>,
    /// Step of the dynamics.
    pub timestep: Option<Timestep>,
    /// Contact field by name.
    pub contact: Option<String>,
    /// Fine cells along one side of a taxel.
    pub cells: Option<usize>,
    /// Error of the taxels' pressures that will do; chooses contact, cells and step.
    pub tolerance: Option<f64>,
    /// Root of every random number.
    pub seed: Option<u64>,
    /// Transducer by name.
    pub transducer: Option<String>,
    /// Readout profile by name, or a file that ends in `.toml`.
    pub readout: Option<String>,
    /// Source of the weights by name.
    pub weights: Option<String>,
    /// Faulty cells, by name of the fault and 0-based taxel, with the parameters' defaults; added to those of the scene file.
    pub faults: Vec<(String, u32)>,
}

/// A scene that is ready to run.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// Short name for the results: of the object, the mesh file or the scene file.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Transducer and readout.
    pub chain: Chain,
    /// The scene as TOML, every default filled in, with the names of [`Prepared::copies`] for the files it needs.
    pub scene_toml: String,
    /// Hash of that text, the mesh and the profile file.
    pub scene_hash: String,
    /// Files that the scene needs beside it: name and content.
    pub copies: Vec<(String, Vec<u8>)>,
    /// What the user should know, such as what was repaired in a mesh. There is one mesh in a run, so it needs no name, and
    /// the notes are the same when its copy is simulated again.
    pub notes: Vec<String>,
}

impl Prepared {
    /// What is pressed or dropped, as the class of its session: the object by name, the mesh by the name of its file, or the ball.
    #[must_use]
    pub fn object(&self) -> &str {
        match self.scene.task() {
            Task::Press(press) => press.object.as_deref().unwrap_or(&self.name),
            Task::Drop(_) => "tennis",
        }
    }

    /// What meets the skin: the object by name, `mesh`, or `ball`.
    #[must_use]
    pub fn body(&self) -> &str {
        match self.scene.task() {
            Task::Press(press) => press.object.as_deref().unwrap_or("mesh"),
            Task::Drop(_) => "ball",
        }
    }

    /// Readout profile as the scene names it; a file goes by the name of its copy.
    #[must_use]
    pub fn readout_name(&self) -> Option<&str> {
        let file = self.copies.iter().map(|(name, _)| name.as_str()).find(|n| is_toml(n));
        file.or(self.scene.config().readout.as_deref())
    }
}

impl Request {
    /// Checks everything that can be checked before the first step.
    ///
    /// # Errors
    /// [`SimulateError`] that names the file or option, the value, and what is valid.
    pub fn prepare(&self) -> Result<Prepared, SimulateError> {
        let (mut name, mut config, folder) = self.start()?;
        if let (Some(file), Some(press)) = (&self.mesh, &mut config.press) {
            name = stem(file);
            press.object = None;
        }
        self.change(&mut config)?;
        config.transducer.get_or_insert_with(|| DEFAULT_TRANSDUCER.to_owned());
        config.weights.get_or_insert_with(|| DEFAULT_WEIGHTS.to_owned());
        let readout = config.readout.get_or_insert_with(|| DEFAULT_READOUT.to_owned());
        let mut saved_readout = readout.clone();
        let mut copies = Vec::new();
        let mut profile_file = None;
        if is_toml(readout) {
            let path = match &self.readout {
                Some(given) => PathBuf::from(given),
                None => folder.join(&*readout),
            };
            let bytes = read(&path)?;
            parse::<Profile>(&path, &bytes)?;
            *readout = utf8("--readout", &path)?;
            profile_file = Some(path);
            saved_readout = "readout.toml".to_owned();
            copies.push((saved_readout.clone(), bytes));
        }
        let mut saved_mesh = None;
        if let Some(press) = &mut config.press {
            if let Some(file) = &self.mesh {
                press.mesh = Some(utf8("--mesh", file)?);
            } else if let Some(file) = &press.mesh {
                press.mesh = Some(utf8("press.mesh", &folder.join(file))?);
            }
            if let Some(file) = &press.mesh {
                let path = Path::new(file);
                let extension = path.extension().unwrap_or_default().to_string_lossy();
                let copy = format!("mesh.{}", extension.to_ascii_lowercase());
                copies.push((copy.clone(), read(path)?));
                saved_mesh = Some(copy);
            }
        }
        name = config.name.get_or_insert(name).clone();
        let scene = Scene::new(config, Path::new("")).map_err(|error| self.in_file(error))?;
        let chain = Chain::new(&scene).map_err(|source| match (source, profile_file) {
            (source @ TwinError::Profile(_), Some(path)) => SimulateError::InProfile {
                path,
                source: Box::new(source),
            },
            (source, _) => source.into(),
        })?;
        let mut saved = scene.config().clone();
        saved.readout = Some(saved_readout);
        if let Some(press) = &mut saved.press {
            press.mesh = saved_mesh;
        }
        let scene_toml = toml::to_string(&saved).map_err(SceneError::Write)?;
        Ok(Prepared {
            scene_hash: hash(&scene, &scene_toml, &copies)?,
            name,
            notes: scene.mesh_report().map(MeshReport::notes).unwrap_or_default(),
            scene,
            chain,
            scene_toml,
            copies,
        })
    }

    /// Name, scene and folder before any option acts.
    fn start(&self) -> Result<(String, SceneConfig, PathBuf), SimulateError> {
        let here = PathBuf::new();
        let pressing = |object: Option<&str>| SceneConfig {
            press: Some(PressConfig {
                object: object.map(str::to_owned),
                presses: 1,
                ..PressConfig::default()
            }),
            ..SceneConfig::default()
        };
        if is_toml(&self.scene) {
            let path = Path::new(&self.scene);
            let config: SceneConfig = parse(path, &read(path)?)?;
            return Ok((stem(path), config, path.parent().unwrap_or(&here).to_owned()));
        }
        match self.scene.split_once('/') {
            Some(("press", _)) if self.mesh.is_some() => Err(SimulateError::Option {
                option: "--mesh",
                value: self.scene.clone(),
                reason: "a mesh takes the place of the object; the scene is `press`",
            }),
            Some(("press", object)) => Ok((object.to_owned(), pressing(Some(object)), here)),
            None if self.scene == "press" && self.mesh.is_some() => Ok(("press".to_owned(), pressing(None), here)),
            None if self.scene == "bounce" => {
                let ball = DropConfig {
                    drops: 1,
                    ..DropConfig::default()
                };
                let config = SceneConfig {
                    drop: Some(ball),
                    ..SceneConfig::default()
                };
                Ok((self.scene.clone(), config, here))
            }
            _ => Err(SimulateError::UnknownScene {
                name: self.scene.clone(),
            }),
        }
    }

    /// Puts the options into the scene.
    fn change(&self, config: &mut SceneConfig) -> Result<(), SimulateError> {
        if let Some(seed) = self.seed {
            config.seed = seed;
        }
        self.change_rung(config);
        replace(&mut config.transducer, &self.transducer);
        replace(&mut config.readout, &self.readout);
        replace(&mut config.weights, &self.weights);
        for (name, taxel) in &self.faults {
            let entries = [("name", name.clone().into()), ("taxel", i64::from(*taxel).into())];
            let entries = entries.map(|(key, value): (&str, toml::Value)| (key.to_owned(), value));
            config.faults.push(entries.into_iter().collect());
        }
        if let Some(press) = &mut config.press {
            replace(&mut press.scale, &self.scale);
            replace(&mut press.row, &self.row);
            replace(&mut press.col, &self.col);
            replace(&mut press.rotation_deg, &self.rotation_deg);
            replace(&mut press.tilt_deg, &self.tilt_deg);
            press.force_n = self.force_n.unwrap_or(press.force_n);
            press.presses = self.presses.unwrap_or(press.presses);
            refuse("--height", self.height_m.as_ref(), "only a ball drops")?;
        }
        if let Some(ball) = &mut config.drop {
            replace(&mut ball.row, &self.row);
            replace(&mut ball.col, &self.col);
            ball.height_m = self.height_m.unwrap_or(ball.height_m);
            ball.drops = self.presses.unwrap_or(ball.drops);
            const REASON: &str = "nothing is pressed in a drop";
            refuse("--mesh", self.mesh.as_ref().map(|m| m.display()).as_ref(), REASON)?;
            refuse("--force", self.force_n.as_ref(), REASON)?;
            refuse("--rotation-deg", self.rotation_deg.as_ref(), REASON)?;
            let tilt = self.tilt_deg.map(|[x, y]| format!("{x},{y}"));
            refuse("--tilt-deg", tilt.as_ref(), REASON)?;
        }
        Ok(())
    }

    /// Contact, resolution and step. An option goes before what the file says of the same, also through a tolerance.
    fn change_rung(&self, config: &mut SceneConfig) {
        if self.tolerance.is_some() {
            for key in ["model", "cells_per_taxel", "coupled", "densification"] {
                config.contact.remove(key);
            }
            config.timestep_s = None;
            config.tolerance = self.tolerance;
        }
        replace(&mut config.timestep_s, &self.timestep);
        if self.timestep.is_some() || self.tolerance.is_some() {
            // one that a saved scene has written out belongs to the step it had
            config.frame_interval_s = config.frame_interval_s.filter(|_| config.press.is_some());
        }
        if let Some(name) = &self.contact {
            change_model(&mut config.contact, name);
        }
        if let Some(cells) = self.cells {
            let cells = i64::try_from(cells).unwrap_or(i64::MAX);
            config.contact.insert("cells_per_taxel".to_owned(), cells.into());
        }
    }

    fn in_file(&self, error: SceneError) -> SceneError {
        if !is_toml(&self.scene) {
            return error;
        }
        SceneError::InFile {
            path: self.scene.clone().into(),
            source: Box::new(error),
        }
    }
}

fn replace<T: Clone>(value: &mut Option<T>, by: &Option<T>) {
    if by.is_some() {
        value.clone_from(by);
    }
}

fn refuse(
    option: &'static str,
    value: Option<&impl std::fmt::Display>,
    reason: &'static str,
) -> Result<(), SimulateError> {
    match value {
        None => Ok(()),
        Some(value) => Err(SimulateError::Option {
            option,
            value: value.to_string(),
            reason,
        }),
    }
}

fn is_toml(text: &str) -> bool {
    Path::new(text).extension().is_some_and(|e| e == "toml")
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn utf8(option: &'static str, path: &Path) -> Result<String, SimulateError> {
    path.to_str().map(str::to_owned).ok_or_else(|| SimulateError::Option {
        option,
        value: path.display().to_string(),
        reason: "the name is not valid UTF-8",
    })
}

fn read(path: &Path) -> Result<Vec<u8>, SimulateError> {
    std::fs::read(path).map_err(|source| SimulateError::Read {
        path: path.to_owned(),
        source,
    })
}

fn parse<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, SimulateError> {
    let text = std::str::from_utf8(bytes).map_err(|error| SimulateError::Read {
        path: path.to_owned(),
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, error),
    })?;
    toml::from_str(text).map_err(|error| SimulateError::parse(path, text, &error))
}

/// Hash of the scene as it is saved: of its text, its mesh bit for bit, and its profile file.
fn hash(scene: &Scene, saved_toml: &str, copies: &[(String, Vec<u8>)]) -> Result<String, SimulateError> {
    let own_toml = scene.to_toml()?.len();
    let mut bytes = saved_toml.as_bytes().to_vec();
    bytes.extend_from_slice(scene.hash_input()?.get(own_toml..).unwrap_or_default());
    for (name, content) in copies {
        if is_toml(name) {
            bytes.extend_from_slice(content);
        }
    }
    Ok(hash_text(&bytes))
}
