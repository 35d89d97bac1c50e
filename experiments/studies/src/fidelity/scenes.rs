//! The scenes of the study: shapes with known contacts, objects with edges, teeth and holes, and the ball.

use super::Reference;
use super::error::FidelityError;
use super::settings::ContactSetting;
use spts::output::write_bytes;
use spts::record::TwinError;
use spts::scene::{DropConfig, PressConfig, Scene, SceneConfig, Task};
use spts_contact::mesh::{TriMesh, cylinder, extrude, sphere};
use std::path::{Path, PathBuf};

/// Names of the built-in scenes.
pub const SCENES: [&str; 7] = ["sphere", "punch", "edge", "T", "tape", "comb", "drop"];

/// A scene of the study, to be run with any level.
#[derive(Debug, Clone)]
pub struct FidelityScene {
    /// Name in the table.
    pub name: String,
    config: SceneConfig,
    folder: PathBuf,
}

/// Presses or drops of a scene: one to learn from and one to score.
const REPEATS: usize = 2;

impl FidelityScene {
    /// Whether the scene is a drop.
    #[must_use]
    pub fn is_drop(&self) -> bool {
        self.config.drop.is_some()
    }

    /// The scene on a level.
    pub(super) fn at(&self, setting: ContactSetting) -> Result<Scene, TwinError> {
        let mut config = self.config.clone();
        setting.level.apply(&mut config.contact, setting.cells_per_taxel);
        config.timestep_s = Some(setting.timestep_s.into());
        Ok(Scene::new(config, &self.folder)?)
    }
}

/// The built-in scenes called `names`, or read from files; all built-in ones when there is no name. Meshes that only
/// the study has are written to `folder`.
pub(super) fn build(names: &[String], seed: u64, folder: &Path) -> Result<Vec<FidelityScene>, FidelityError> {
    let all: Vec<String> = SCENES.iter().map(|&name| name.to_owned()).collect();
    let names = if names.is_empty() { &all } else { names };
    let mut scenes: Vec<FidelityScene> = Vec::new();
    for name in names {
        let scene = if Path::new(name).extension().is_some_and(|e| e == "toml") {
            from_file(Path::new(name))?
        } else {
            built_in(name, seed, folder)?
        };
        if scenes.iter().any(|s| s.name == scene.name) {
            return Err(FidelityError::RepeatedScene { name: name.clone() });
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

/// What else might be pressed: the built-in scenes that were not asked for, with everything at its default but the
/// skin, which is that of the references. Those that such a skin cannot bear are left out.
pub(super) fn others(references: &[Reference], seed: u64, folder: &Path) -> Result<Vec<Scene>, FidelityError> {
    let Some(first) = references.first() else {
        return Ok(Vec::new());
    };
    let skin = *first.at_reference.skin();
    if let Some(other) = references.iter().find(|r| *r.at_reference.skin() != skin) {
        return Err(FidelityError::DifferentSkins {
            first: first.scene.name.clone(),
            other: other.scene.name.clone(),
        });
    }
    let left = SCENES
        .iter()
        .filter(|name| references.iter().all(|r| r.scene.name != **name));
    let scenes = left.map(|name| {
        let scene = built_in(name, seed, folder)?;
        let config = SceneConfig { skin, ..scene.config };
        Ok(Scene::new(config, folder).ok())
    });
    Ok(scenes
        .collect::<Result<Vec<_>, FidelityError>>()?
        .into_iter()
        .flatten()
        .collect())
}

fn built_in(name: &str, seed: u64, folder: &Path) -> Result<FidelityScene, FidelityError> {
    let mut press = PressConfig {
        presses: REPEATS,
        ..PressConfig::default()
    };
    let mut ball = None;
    match name {
        "T" | "tape" | "comb" => press.object = Some(name.to_owned()),
        "drop" => {
            // one bounce from the full height, and the start of the next
            let drops = REPEATS;
            ball = Some(DropConfig {
                drops,
                duration_s: 0.7,
                ..DropConfig::default()
            });
        }
        _ => {
            let Some(mesh) = shape(name) else {
                return Err(FidelityError::UnknownScene {
                    name: name.to_owned(),
                    known: SCENES.join(", "),
                });
            };
            let file = format!("{name}.obj");
            write_bytes(&folder.join(&file), mesh.to_obj(name).as_bytes())?;
            press.mesh = Some(file);
            [press.row, press.col] = PLACE.map(Some);
            press.rotation_deg = Some(ROTATION_DEG);
        }
    }
    Ok(FidelityScene {
        name: name.to_owned(),
        config: SceneConfig {
            seed,
            press: ball.is_none().then_some(press),
            drop: ball,
            ..SceneConfig::default()
        },
        folder: folder.to_owned(),
    })
}

/// Where the shapes are pressed, row and column, and how they are turned: off every symmetry of taxels and cells.
const PLACE: [f64; 2] = [4.35, 4.6];
const ROTATION_DEG: f64 = 31.0;

/// A rigid sphere of a tennis ball's size, a flat round punch, or a blunt edge.
fn shape(name: &str) -> Option<TriMesh> {
    match name {
        "sphere" => Some(sphere(33.4e-3, 48, 96)),
        "punch" => Some(cylinder(20e-3, 15e-3, 96)),
        "edge" => {
            // a prism of 60 mm, its sides at 60° to the vertical, laid on its edge
            let (half_m, height_m) = (17.3e-3, 10e-3);
            let section = [[0.0, 0.0], [half_m, height_m], [-half_m, height_m]];
            let prism = extrude(&section, &[], 60e-3).translated([0.0, 0.0, -30e-3]);
            Some(prism.rotated_x(std::f64::consts::FRAC_PI_2))
        }
        _ => None,
    }
}

/// A user's scene: its first two presses or drops, without what the levels decide.
fn from_file(path: &Path) -> Result<FidelityScene, FidelityError> {
    let scene = Scene::load(path).map_err(TwinError::from)?;
    let mut config = scene.config().clone();
    match scene.task() {
        Task::Press(press) => {
            let press = press.clone();
            config.press = Some(PressConfig {
                presses: REPEATS,
                ..press
            });
        }
        Task::Drop(ball) => {
            let ball = ball.clone();
            config.drop = Some(DropConfig { drops: REPEATS, ..ball });
        }
    }
    // the levels bring their own
    config.frame_interval_s = None;
    Ok(FidelityScene {
        name: path
            .file_stem()
            .map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        config,
        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
    })
}
