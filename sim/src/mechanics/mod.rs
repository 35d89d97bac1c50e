//! The mechanical part of a scene: what happens on the skin, read from TOML or built in code. A [`Mechanics`] is valid
//! by construction.
//!
//! ```toml
//! seed = 7
//! [contact]
//! model = "winkler"
//! stiffness_pa_per_m = 1.5e7
//! [press]
//! object = "T"
//! force_n = 20.0
//! presses = 10
//! ```

mod bend;
mod config;
mod drop;
mod error;
mod limit;
mod overhang;
mod place;
mod pose;
mod press;
#[cfg(test)]
mod tests;
mod timestep;
mod tolerance;

pub use bend::BendConfig;
pub use config::MechanicsConfig;
pub use drop::DropConfig;
pub use error::{MAX_LIDDED_TILT_DEG, MechanicsError};
pub use overhang::Overhang;
pub use press::PressConfig;
#[cfg(feature = "engine")]
pub(crate) use press::{RAMP_CORNER, ramp_s};
pub use timestep::{BLOCK_S, LONGEST_STEP_S, SHORTEST_STEP_S, Timestep};

#[cfg(feature = "engine")]
use crate::checks::build_field_or_check;
#[cfg(not(feature = "engine"))]
use spts_contact::build_contact as build_field_or_check;
use spts_contact::mesh::{MeshReport, TriMesh, sphere};
use spts_contact::{ContactField, DepthCurve, PosedMesh, PreparedMesh};
use spts_models::{SkinLayout, in_range};
use std::path::Path;
use std::sync::Arc;

/// Smallest mass that moves with an object on the flange, kg: the effective mass of the arm's rotors (1 and 0.2 kg m²
/// at the joints) at the tool, along the skin's normal.
pub const ARM_MASS_KG: f64 = 1.5;

/// What happens in a scene: presses by the arm, or drops of a ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task<'a> {
    /// The arm presses an object.
    Press(&'a PressConfig),
    /// A ball falls.
    Drop(&'a DropConfig),
}

/// Longest time between the frames of a press, s: ten frames a second still show its ramps.
const LONGEST_FRAME_INTERVAL_S: f64 = 0.1;
/// What `frame_interval_s` may be, for errors.
const FRAME_INTERVAL_RANGE: &str = "[timestep_s, 0.1] s for a press, [timestep_s, 2e-4] s for a drop";

/// The mechanical part of a scene, checked, with the mesh of its object: what presses on the skin, where and how hard.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanics {
    config: MechanicsConfig,
    timestep_s: f64,
    frame_interval_s: f64,
    mesh: PreparedMesh,
    mesh_report: Option<MeshReport>,
    curve: Arc<DepthCurve>,
}

impl Mechanics {
    /// The scene that `config` describes. Mesh files are looked up in `folder`.
    ///
    /// # Errors
    /// [`MechanicsError`] for the first value that is not valid.
    pub fn new(config: MechanicsConfig, folder: &Path) -> Result<Self, MechanicsError> {
        Self::build(config, folder, None)
    }

    /// The scene in which the arm presses `mesh` (body axes, m). The mesh has no file and no name: `config.press` must
    /// name neither an object nor a mesh, and the text of the scene ([`Mechanics::to_toml`]) does not describe it.
    ///
    /// # Errors
    /// [`MechanicsError`] for the first value that is not valid.
    pub fn of_mesh(config: MechanicsConfig, mesh: PreparedMesh) -> Result<Self, MechanicsError> {
        Self::build(config, Path::new(""), Some(mesh))
    }

    fn build(config: MechanicsConfig, folder: &Path, given: Option<PreparedMesh>) -> Result<Self, MechanicsError> {
        let (mut config, choice) = config.with_level_chosen()?;
        if i64::try_from(config.seed).is_err() {
            return Err(MechanicsError::Seed { seed: config.seed });
        }
        let skin = config.skin;
        let model = config.contact.remove("model");
        let model = match &model {
            None => "winkler",
            Some(value) => value.as_str().unwrap_or("(not a string)"),
        };
        let mut field = build_field_or_check(model, config.contact, &skin)?;
        let quasi_static = field.quasi_static().is_some();
        if quasi_static && config.drop.is_some() {
            return Err(MechanicsError::NeedsForce {
                model: model.to_owned(),
            });
        }
        if let Some(bend) = &config.bend {
            bend.check()?;
            if config.drop.is_some() {
                return Err(MechanicsError::BentDrop);
            }
        }
        config.contact = field.parameters();
        config.contact.insert("model".to_owned(), model.into());
        let ((mesh, mesh_report), default_step_s, interval_s, longest_s): (_, f64, f64, f64) =
            match (&mut config.press, &mut config.drop) {
                (Some(press), None) => {
                    let (mesh, report) = press.resolve(&skin, folder, given)?;
                    let mesh = match &config.bend {
                        None => mesh,
                        Some(bend) => bend.unroll(&mesh, press.placement().matrix()).into(),
                    };
                    ((mesh, report), 5e-4, 2e-3, LONGEST_FRAME_INTERVAL_S)
                }
                (None, Some(ball)) => {
                    ball.resolve(&skin)?;
                    let interval_s = match config.timestep_s {
                        Some(Timestep::Seconds(step_s)) => step_s,
                        Some(Timestep::Auto) | None => 1e-4,
                    };
                    ((ball_mesh(ball.radius_m).into(), None), 1e-4, interval_s, 2e-4)
                }
                (press, ball) => {
                    return Err(MechanicsError::OneOf {
                        choices: "[press] and [drop]",
                        found: usize::from(press.is_some()) + usize::from(ball.is_some()),
                    });
                }
            };
        let asked = config
            .timestep_s
            .unwrap_or(Timestep::Seconds(default_step_s))
            .checked()?;
        // a step that was chosen, not written, gives way to a stiffer scene
        let asked = if choice.is_some() { Timestep::Auto } else { asked };
        if let Some(interval_s) = config.frame_interval_s {
            let valid = (SHORTEST_STEP_S..=LONGEST_FRAME_INTERVAL_S).contains(&interval_s);
            in_range("frame_interval_s", interval_s, valid, FRAME_INTERVAL_RANGE)?;
        }
        let between_frames_s = config.frame_interval_s.unwrap_or(interval_s);
        let longest_step_s = choice.map_or(between_frames_s, |c| c.timestep_s.min(between_frames_s));
        let mut scene = Self {
            config,
            timestep_s: default_step_s,
            frame_interval_s: interval_s,
            mesh,
            mesh_report,
            curve: Arc::new(DepthCurve::empty()),
        };
        field.expect(&scene.mesh);
        if scene.config.bend.is_some() && scene.preload(field.as_mut(), 0).is_none() {
            return Err(MechanicsError::BentField {
                model: model.to_owned(),
            });
        }
        scene.curve = Arc::new(scene.find_depth_curve(field.as_mut())?);
        let limit = scene.step_limit(field.as_mut());
        let timestep_s = match asked {
            // nothing is stepped, but a step that no scene can have is a mistake
            Timestep::Seconds(step_s) if quasi_static => {
                in_range("timestep_s", step_s, step_s <= LONGEST_STEP_S, "[1e-6, 2e-3] s")?
            }
            Timestep::Auto if quasi_static => longest_step_s.min(LONGEST_STEP_S),
            _ => limit.resolve(asked, longest_step_s)?,
        };
        scene.timestep_s = timestep_s;
        scene.config.timestep_s = Some(timestep_s.into());
        let frame_interval_s = &mut scene.config.frame_interval_s;
        scene.frame_interval_s = *frame_interval_s.get_or_insert(interval_s.max(timestep_s));
        in_range(
            "frame_interval_s",
            scene.frame_interval_s,
            (timestep_s * (1.0 - 1e-9)..=longest_s.max(timestep_s)).contains(&scene.frame_interval_s),
            FRAME_INTERVAL_RANGE,
        )?;
        Ok(scene)
    }

    /// The scene in the TOML text `text`.
    ///
    /// # Errors
    /// [`MechanicsError`] if the text is not TOML, or the scene is not valid.
    pub fn from_toml(text: &str, folder: &Path) -> Result<Self, MechanicsError> {
        Self::new(toml::from_str(text)?, folder)
    }

    /// [`MechanicsConfig::press`] with all defaults.
    ///
    /// # Errors
    /// [`MechanicsError::UnknownObject`].
    pub fn press(name: &str) -> Result<Self, MechanicsError> {
        Self::new(MechanicsConfig::press(name), Path::new(""))
    }

    /// [`MechanicsConfig::bounce`] with all defaults.
    ///
    /// # Errors
    /// None, with the defaults as they are.
    pub fn bounce() -> Result<Self, MechanicsError> {
        Self::new(MechanicsConfig::bounce(), Path::new(""))
    }

    /// The configuration, with all defaults filled in.
    #[must_use]
    pub fn config(&self) -> &MechanicsConfig {
        &self.config
    }

    /// The task.
    ///
    /// # Panics
    /// Never: a scene has exactly one task.
    #[must_use]
    pub fn task(&self) -> Task<'_> {
        match (&self.config.press, &self.config.drop) {
            (Some(press), _) => Task::Press(press),
            (None, Some(ball)) => Task::Drop(ball),
            (None, None) => unreachable!("a scene has exactly one task"),
        }
    }

    /// Number of presses or drops.
    #[must_use]
    pub fn repeats(&self) -> usize {
        match self.task() {
            Task::Press(press) => press.presses,
            Task::Drop(ball) => ball.drops,
        }
    }

    /// Duration of one press or drop, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match self.task() {
            Task::Press(press) => press.duration_s,
            Task::Drop(ball) => ball.duration_s,
        }
    }

    /// The skin.
    #[must_use]
    pub fn skin(&self) -> &SkinLayout {
        &self.config.skin
    }

    /// Seed of all random numbers.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.config.seed
    }

    /// Time step of the dynamics, s.
    #[must_use]
    pub fn timestep_s(&self) -> f64 {
        self.timestep_s
    }

    /// Time between frames, s; for a drop, while the ball is near the skin.
    #[must_use]
    pub fn frame_interval_s(&self) -> f64 {
        self.frame_interval_s
    }

    /// Mesh of the object or ball, in body axes.
    #[must_use]
    pub fn mesh(&self) -> &PreparedMesh {
        &self.mesh
    }

    /// Report on a mesh from a file; `None` for the seventeen objects and the ball.
    #[must_use]
    pub fn mesh_report(&self) -> Option<&MeshReport> {
        self.mesh_report.as_ref()
    }

    /// Puts the contact field `field` under the preload of a bent skin before press `index`, and returns the resulting
    /// pressure of every taxel, Pa. `None` for a flat skin, and for a contact field without preloads.
    pub fn preload(&self, field: &mut dyn ContactField, index: u64) -> Option<Vec<f64>> {
        let bend = self.config.bend.as_ref()?;
        field.preload(&bend.strain(self.skin(), self.seed(), index))
    }

    /// A fresh contact field without preload (see [`Mechanics::preload`]).
    ///
    /// # Errors
    /// None for a valid scene: it was built with these parameters before.
    pub fn build_contact(&self) -> Result<Box<dyn ContactField>, MechanicsError> {
        let mut parameters = self.config.contact.clone();
        let model = parameters.remove("model");
        let model = model.as_ref().and_then(toml::Value::as_str).unwrap_or_default();
        let mut field = build_field_or_check(model, parameters, &self.config.skin)?;
        field.expect(&self.mesh);
        Ok(field)
    }

    /// The scene as TOML, with all defaults filled in. Reading it back gives the same scene.
    ///
    /// # Errors
    /// [`MechanicsError::Write`], which no valid scene should cause.
    pub fn to_toml(&self) -> Result<String, MechanicsError> {
        Ok(toml::to_string(&self.config)?)
    }

    /// The body as it meets the skin (height 0, at rest), and the mass behind it, kg.
    pub(crate) fn contact_body(&self) -> (PosedMesh<'_>, f64) {
        let at = |row, col| {
            let [x, y] = self.skin().position_m(row, col);
            PosedMesh::at_rest(&self.mesh, [x, y, 0.0])
        };
        match self.task() {
            Task::Press(press) => {
                let place = press.placement();
                let body = PosedMesh {
                    rotation: place.matrix(),
                    stiffness_pa_per_m: press.stiffness_pa_per_m.unwrap_or(f64::INFINITY),
                    ..at(place.row, place.col)
                };
                (body, press.mass_kg + ARM_MASS_KG)
            }
            Task::Drop(ball) => {
                let body = PosedMesh {
                    stiffness_pa_per_m: ball.stiffness_pa_per_m,
                    ..at(ball.row.unwrap_or_default(), ball.col.unwrap_or_default())
                };
                (body, ball.mass_kg)
            }
        }
    }

    /// Static curve of the contact: up to the target force and a quarter more, or up to the ball's energy.
    pub(crate) fn depth_curve(&self) -> &Arc<DepthCurve> {
        &self.curve
    }

    fn find_depth_curve(&self, field: &mut dyn ContactField) -> Result<DepthCurve, MechanicsError> {
        let (body, _) = self.contact_body();
        Ok(match self.task() {
            Task::Press(press) => {
                let curve = DepthCurve::up_to_force(field, &body, 1.25 * press.force_n);
                curve.map_err(|source| MechanicsError::Press {
                    force_n: press.force_n,
                    source,
                })?
            }
            Task::Drop(ball) => {
                let energy_j = ball.mass_kg * GRAVITY_M_PER_S2 * ball.height_m;
                let curve = DepthCurve::up_to_energy(field, &body, energy_j);
                curve.map_err(|source| MechanicsError::Drop {
                    mass_kg: ball.mass_kg,
                    height_m: ball.height_m,
                    source,
                })?
            }
        })
    }
}

/// Standard gravity, m/s².
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Ball with its origin in its centre. Facets of 5° lie at most R (1 − cos 2.5°) = 1e-3 R inside the sphere.
fn ball_mesh(radius_m: f64) -> TriMesh {
    sphere(radius_m, 36, 64).translated([0.0, 0.0, -radius_m])
}
