//! The mechanical part of a scene: as it is written, checked, and what follows from it.

use super::bend::BendConfig;
use super::press::{DropConfig, PressConfig};
use super::timestep::{LONGEST_STEP_S, SHORTEST_STEP_S, StepLimit, Timestep, impact_damping};
use crate::fidelity::{Courses, FidelityChoice, FidelityLevel, Tolerance, change_model, choose};
use crate::world::apart;
use serde::{Deserialize, Serialize};
use spts_contact::mesh::{MeshReport, TriMesh, sphere};
use spts_contact::{ContactField, DepthCurve, EquilibriumError, Pose, PosedMesh, PreparedMesh, build_contact};
use spts_input::Refusal;
use spts_models::{SkinLayout, in_range, parsed_text};
use std::path::Path;
use std::sync::Arc;

/// The mechanical part of a scene, as written in TOML. A missing field takes its default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MechanicsConfig {
    /// Seed of all random numbers; [0, 2^63).
    pub seed: u64,
    /// Time step of the dynamics, s; from 1e-6 to the stable limit, which is at most 2e-3. `"auto"` is the longest
    /// stable step that divides `frame_interval_s`. Default 0.5 ms for a press, 0.1 ms for a drop.
    pub timestep_s: Option<Timestep>,
    /// The error that the scene may have. It replaces `contact.model`, `contact.cells_per_taxel` and `timestep_s`: the
    /// scene uses the cheapest level that meets the tolerance on its own contact ([`crate::fidelity`]).
    pub tolerance: Option<Tolerance>,
    /// The tolerance for which `contact.model`, `contact.cells_per_taxel` and `timestep_s` were chosen. A scene with a
    /// `tolerance` stores it here when it is saved, together with the chosen values. It changes no result.
    pub chosen_for_tolerance: Option<Tolerance>,
    /// What was expected of that choice: the relative error of the taxels' pressures, how far the finest level may
    /// itself be off, and how many times longer that takes. It changes no result.
    pub chosen: Option<Expected>,
    /// Time between frames, s; [`timestep_s`, 0.1]. Default 2 ms for a press. A drop uses it while the ball is near the
    /// skin (default one time step, 0.1 ms with `timestep_s = "auto"`; at most 0.2 ms), and 2 ms otherwise.
    pub frame_interval_s: Option<f64>,
    /// The skin.
    pub skin: SkinLayout,
    /// Contact model (`model`) and its parameters.
    pub contact: toml::Table,
    /// Bends the skin round a cylinder. Default: the skin is flat.
    pub bend: Option<BendConfig>,
    /// Presses an object with the arm. A scene has either this or `drop`.
    pub press: Option<PressConfig>,
    /// Drops a ball. A scene has either this or `press`.
    pub drop: Option<DropConfig>,
}

impl MechanicsConfig {
    /// Ten presses of the object called `name` by the arm, at the object's place.
    pub fn press(name: &str) -> Self {
        Self { press: Some(PressConfig { object: Some(name.to_owned()), ..PressConfig::default() }), ..Self::default() }
    }

    /// Ten drops of a tennis ball from half a metre onto the middle of the skin.
    pub fn bounce() -> Self {
        Self { drop: Some(DropConfig::default()), ..Self::default() }
    }
}

/// What was expected of the choice for a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Relative root mean square error of the taxels' pressures against the finest level.
    pub error: f64,
    /// How far the pressures of the finest level moved when its cells were halved, in the same measure.
    pub finest_error: f64,
    /// Times that the finest level takes as long, by the means of the shipped table.
    pub saves: f64,
}

/// What a tolerance chooses; a scene that has one must not say it too.
const CHOSEN: [&str; 3] = ["model", "cells_per_taxel", "coupled"];

impl MechanicsConfig {
    /// Replaces `tolerance`, when there is one, by the cheapest fidelity level that meets it on this scene's contact.
    /// What is returned has no `tolerance`, so that it stays the same scene when the choice is made otherwise; whether
    /// there was one.
    fn with_level_chosen(mut self, folder: &Path, given: Option<&PreparedMesh>) -> Result<(Self, bool), Refusal> {
        self.chosen_for_tolerance.map(|t| t.checked("chosen_for_tolerance")).transpose()?;
        let Some(tolerance) = self.tolerance.take().map(|t| t.checked("tolerance")).transpose()? else {
            return Ok((self, false));
        };
        if let Some(key) = CHOSEN.iter().find(|key| self.contact.contains_key(**key)) {
            return Err(chosen_twice(&format!("contact.{key}")));
        }
        if self.timestep_s.is_some() {
            return Err(chosen_twice("timestep_s"));
        }
        let mut columns = self.clone();
        change_model(&mut columns.contact, "winkler");
        columns.timestep_s = Some(Timestep::Auto);
        let scene = Mechanics::build(columns, folder, given.cloned())?;
        // an elastic field may have no answer somewhere
        let can_have = |level: &FidelityLevel, cells: usize| {
            let mut config = Self { timestep_s: Some(Timestep::Auto), ..self.clone() };
            level.apply(&mut config.contact, cells);
            level.coupled.is_none() || Mechanics::build(config, folder, given.cloned()).is_ok()
        };
        // courses need MuJoCo; without them the choice would differ
        crate::engine::open()?;
        let courses = |courses: Courses| {
            let at = |level: &str, cells: usize| {
                let mut config = Self { timestep_s: Some(Timestep::Auto), ..self.clone() };
                FidelityLevel::named(level).iter().for_each(|level| level.apply(&mut config.contact, cells));
                Mechanics::build(config, folder, given.cloned())
            };
            let (found, expected, of): (_, _, fn(&spts_contact::Frame) -> &[f64]) = match courses {
                Courses::AtRest(cells) => (at("footprint", cells), at("winkler", cells), |f| f.pressure.values()),
                Courses::Columns(cells) => (at("winkler", cells), at("layer", cells), |f| &f.wrench.force_n[2..]),
            };
            let both = found.and_then(|found| Ok((found, expected?)));
            both.and_then(|(found, expected)| apart(&found, &expected, of)).unwrap_or(f64::INFINITY)
        };
        let choice = choose(&scene, &self.contact, tolerance, can_have, courses)?;
        choice.level.apply(&mut self.contact, choice.cells_per_taxel);
        self.chosen_for_tolerance = Some(tolerance);
        let FidelityChoice { error, finest_error, saves, .. } = choice;
        self.chosen = Some(Expected { error, finest_error, saves });
        Ok((self, true))
    }
}

/// The error of a tolerance together with one of the values that it determines.
fn chosen_twice(key: &str) -> Refusal {
    Refusal::new(format!("`tolerance` chooses contact model, cells and time step; leave out `{key}`, or the tolerance"))
}

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

/// Time between the frames of a drop while the ball is away from the skin, s.
pub const FLIGHT_INTERVAL_S: f64 = 2e-3;
/// Longest time between the frames of a press, s: ten frames a second still show its ramps.
const LONGEST_FRAME_INTERVAL_S: f64 = 0.1;
/// Time between the frames of a press where no other is asked for, s: the least and the most.
const USUAL_INTERVAL_S: [f64; 2] = [2e-3, 2e-2];
/// Frames times taxels of a press from which on its frames are further apart than the least: 67 MB a map.
const USUAL_VALUES: f64 = (1_u64 << 23) as f64;

/// Time between the frames of a press of `duration_s` on a skin of so many taxels, s: on large skins as long as their
/// number allows.
fn usual_interval_s(duration_s: f64, taxels: usize) -> f64 {
    let [least_s, most_s] = USUAL_INTERVAL_S;
    (duration_s * taxels as f64 / USUAL_VALUES).clamp(least_s, most_s)
}

/// What `frame_interval_s` may be, for errors.
const FRAME_INTERVAL_RANGE: &str = "[timestep_s, 0.1] s for a press, [timestep_s, 2e-4] s for a drop";

/// The mechanical part of a scene, checked, with the mesh of its object: what presses on the skin, where and how hard.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanics {
    config: MechanicsConfig,
    timestep_s: f64,
    frame_interval_s: f64,
    step_limit_s: f64,
    mesh: PreparedMesh,
    mesh_report: Option<MeshReport>,
    curve: Arc<DepthCurve>,
}

impl Mechanics {
    /// The scene that `config` describes. Mesh files are looked up in `folder`.
    ///
    /// # Errors
    /// [`Refusal`] for the first value that is not valid.
    pub fn new(config: MechanicsConfig, folder: &Path) -> Result<Self, Refusal> {
        Self::build(config, folder, None)
    }

    /// The scene in which the arm presses `mesh` (body axes, m). The mesh has no file and no name: `config.press` must
    /// name neither an object nor a mesh, and the text of the scene ([`Mechanics::to_toml`]) does not describe it.
    ///
    /// # Errors
    /// [`Refusal`] for the first value that is not valid.
    pub fn of_mesh(config: MechanicsConfig, mesh: PreparedMesh) -> Result<Self, Refusal> {
        Self::build(config, Path::new(""), Some(mesh))
    }

    fn build(config: MechanicsConfig, folder: &Path, given: Option<PreparedMesh>) -> Result<Self, Refusal> {
        let (mut config, chosen) = config.with_level_chosen(folder, given.as_ref())?;
        if i64::try_from(config.seed).is_err() {
            return Err(Refusal::new(format!("`seed` = {} is outside [0, 2^63)", config.seed)));
        }
        let skin = config.skin;
        let model = config.contact.remove("model");
        let model = match &model {
            None => "winkler",
            Some(value) => value.as_str().unwrap_or("(not a string)"),
        };
        let mut field = build_contact(model, config.contact, &skin)?;
        let quasi_static = field.quasi_static().is_some();
        if quasi_static && config.drop.is_some() {
            return Err(Refusal::new(format!(
                "`contact.model` = \"{model}\" needs a force and cannot stop a ball: use [press] instead of [drop], or \
                 another model"
            )));
        }
        if let Some(bend) = &config.bend {
            bend.check()?;
            let round_m = std::f64::consts::TAU * bend.radius_m;
            let [along_m, _] = skin.extent_m();
            if along_m > round_m {
                let range = format!(
                    "[{:.4}, 10] m: a row of {along_m} m would overlap itself",
                    along_m / std::f64::consts::TAU
                );
                return Err(Refusal::range("bend.radius_m", bend.radius_m, range));
            }
            if config.drop.is_some() {
                return Err(Refusal::new(
                    "[bend] requires [press]: drops on a bent skin are not simulated; remove [bend]",
                ));
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
                    let interval_s = usual_interval_s(press.duration_s, skin.taxels());
                    ((mesh, report), 5e-4, interval_s, LONGEST_FRAME_INTERVAL_S)
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
                    let found = usize::from(press.is_some()) + usize::from(ball.is_some());
                    return Err(Refusal::new(format!("exactly one of [press] and [drop] is needed, found {found}")));
                }
            };
        let asked = config.timestep_s.unwrap_or(Timestep::Seconds(default_step_s)).checked()?;
        // a step that was chosen, not written, gives way to a stiffer scene
        let asked = if chosen { Timestep::Auto } else { asked };
        if let Some(interval_s) = config.frame_interval_s {
            let valid = (SHORTEST_STEP_S..=LONGEST_FRAME_INTERVAL_S).contains(&interval_s);
            in_range("frame_interval_s", interval_s, valid, FRAME_INTERVAL_RANGE)?;
        }
        let between_frames_s = config.frame_interval_s.unwrap_or(interval_s);
        let mut scene = Self {
            config,
            timestep_s: default_step_s,
            frame_interval_s: interval_s,
            step_limit_s: 0.0,
            mesh,
            mesh_report,
            curve: Arc::new(DepthCurve::empty()),
        };
        field.expect(&scene.mesh);
        if scene.config.bend.is_some() && scene.preload(field.as_mut(), 0).is_none() {
            return Err(Refusal::new(format!(
                "`contact.model` = \"{model}\" has no preload, which [bend] needs; valid: \"winkler\", \"footprint\""
            )));
        }
        scene.curve = Arc::new(scene.find_depth_curve(field.as_mut())?);
        let limit = scene.step_limit(field.as_mut());
        scene.step_limit_s = limit.limit_s();
        let timestep_s = match asked {
            // nothing is stepped, but a step that no scene can have is a mistake
            Timestep::Seconds(step_s) if quasi_static => {
                in_range("timestep_s", step_s, step_s <= LONGEST_STEP_S, "[1e-6, 2e-3] s")?
            }
            Timestep::Auto if quasi_static => between_frames_s.min(LONGEST_STEP_S),
            _ => limit.resolve(asked, between_frames_s)?,
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
    /// [`Refusal`] if the text is not TOML, or the scene is not valid.
    pub fn from_toml(text: &str, folder: &Path) -> Result<Self, Refusal> {
        Self::new(parsed_text(text)?, folder)
    }

    /// [`MechanicsConfig::press`] with all defaults.
    ///
    /// # Errors
    /// [`Refusal`] for an unknown object.
    pub fn press(name: &str) -> Result<Self, Refusal> {
        Self::new(MechanicsConfig::press(name), Path::new(""))
    }

    /// [`MechanicsConfig::bounce`] with all defaults.
    ///
    /// # Errors
    /// None, with the defaults as they are.
    pub fn bounce() -> Result<Self, Refusal> {
        Self::new(MechanicsConfig::bounce(), Path::new(""))
    }

    /// The configuration, with all defaults filled in.
    pub fn config(&self) -> &MechanicsConfig {
        &self.config
    }

    /// The task.
    ///
    /// # Panics
    /// Never: a scene has exactly one task.
    pub fn task(&self) -> Task<'_> {
        match (&self.config.press, &self.config.drop) {
            (Some(press), _) => Task::Press(press),
            (None, Some(ball)) => Task::Drop(ball),
            (None, None) => unreachable!("a scene has exactly one task"),
        }
    }

    /// Number of presses or drops.
    pub fn repeats(&self) -> usize {
        match self.task() {
            Task::Press(press) => press.presses,
            Task::Drop(ball) => ball.drops,
        }
    }

    /// Duration of one press or drop, s.
    pub fn duration_s(&self) -> f64 {
        match self.task() {
            Task::Press(press) => press.duration_s,
            Task::Drop(ball) => ball.duration_s,
        }
    }

    /// The skin.
    pub fn skin(&self) -> &SkinLayout {
        &self.config.skin
    }

    /// Seed of all random numbers.
    pub fn seed(&self) -> u64 {
        self.config.seed
    }

    /// Time step of the dynamics, s.
    pub fn timestep_s(&self) -> f64 {
        self.timestep_s
    }

    /// Largest stable time step of the dynamics, s.
    pub fn step_limit_s(&self) -> f64 {
        self.step_limit_s
    }

    /// Time between frames, s; for a drop, while the ball is near the skin.
    pub fn frame_interval_s(&self) -> f64 {
        self.frame_interval_s
    }

    /// Mesh of the object or ball, in body axes.
    pub fn mesh(&self) -> &PreparedMesh {
        &self.mesh
    }

    /// Report on a mesh from a file; `None` for the seventeen objects and the ball.
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
    pub fn build_contact(&self) -> Result<Box<dyn ContactField>, Refusal> {
        let mut parameters = self.config.contact.clone();
        let model = parameters.remove("model");
        let model = model.as_ref().and_then(toml::Value::as_str).unwrap_or_default();
        let mut field = build_contact(model, parameters, &self.config.skin)?;
        field.expect(&self.mesh);
        Ok(field)
    }

    /// The scene as TOML, with all defaults filled in. Reading it back gives the same scene.
    ///
    /// # Errors
    /// [`Refusal`], which no valid scene should cause.
    pub fn to_toml(&self) -> Result<String, Refusal> {
        toml::to_string(&self.config).map_err(|error| Refusal::new(format!("cannot be written: {error}")))
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

    /// Limit from the static curve, and for a drop from the damping that `field`, the scene's own, gives on the way
    /// down too.
    fn step_limit(&self, field: &mut dyn ContactField) -> StepLimit {
        let stiffness_n_per_m = self.depth_curve().stiffness_n_per_m();
        let (body, mass_kg) = self.contact_body();
        let at_rest = field.damping_s() * stiffness_n_per_m;
        let damping_n_s_per_m = match self.task() {
            // comes down at millimetres a second
            Task::Press(_) => at_rest,
            Task::Drop(ball) => {
                let speed_m_per_s = (2.0 * GRAVITY_M_PER_S2 * ball.height_m).sqrt();
                let touch_m = ball.radius_m;
                at_rest.max(impact_damping(field, &body, mass_kg, stiffness_n_per_m, [touch_m, speed_m_per_s]))
            }
        };
        StepLimit::new(mass_kg, stiffness_n_per_m, damping_n_s_per_m)
    }

    /// The same scene with any step, its limit notwithstanding.
    #[cfg(test)]
    pub(crate) fn with_step(mut self, step_s: f64) -> Self {
        self.timestep_s = step_s;
        self.frame_interval_s = self.frame_interval_s.max(step_s);
        self.config.timestep_s = Some(step_s.into());
        self
    }

    fn find_depth_curve(&self, field: &mut dyn ContactField) -> Result<DepthCurve, Refusal> {
        let (body, _) = self.contact_body();
        Ok(match self.task() {
            Task::Press(press) => {
                let curve = DepthCurve::up_to_force(field, &body, 1.25 * press.force_n);
                curve.map_err(|error| match (&error, self.mesh_report()) {
                    (EquilibriumError::Beside { .. }, Some(report)) => press.beside(report),
                    _ => Refusal::new(format!("`press.force_n` = {}: {error}", press.force_n)),
                })?
            }
            Task::Drop(ball) => {
                let energy_j = ball.mass_kg * GRAVITY_M_PER_S2 * ball.height_m;
                let (mass_kg, height_m) = (ball.mass_kg, ball.height_m);
                let refused = |why: String| {
                    Refusal::new(format!("`drop.mass_kg` = {mass_kg} from `drop.height_m` = {height_m}: {why}"))
                };
                let curve = DepthCurve::up_to_energy(field, &body, energy_j).map_err(|e| refused(e.to_string()))?;
                let squeezed_m = curve.depth_m(f64::INFINITY) - field.thickness_m();
                let based = self.config.contact.get("model").and_then(toml::Value::as_str) != Some("half_space");
                if based && squeezed_m > ball.radius_m {
                    return Err(refused(format!(
                        "the ball would be flattened by {:.1} mm on the base of the foam, and its surface is modelled up to \
                         its radius of {:.1} mm; a smaller mass or height, or thicker foam, is needed",
                        1e3 * squeezed_m,
                        1e3 * ball.radius_m
                    )));
                }
                curve
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

impl Mechanics {
    /// The scene's body at rest in the pose of a frame, to evaluate a contact field at that instant again.
    pub fn posed(&self, pose: &Pose) -> PosedMesh<'_> {
        let (body, _) = self.contact_body();
        PosedMesh {
            rotation: matrix(pose.quaternion),
            stiffness_pa_per_m: body.stiffness_pa_per_m,
            ..PosedMesh::at_rest(body.mesh, pose.position_m)
        }
    }
}

/// Rotation matrix, row-major, of a unit quaternion (w, x, y, z).
fn matrix([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// How far the part of a body that can touch the skin extends beyond each edge of the sheet, m; 0 if it does not.
///
/// ```
/// use spts_sim::Mechanics;
///
/// let middle = Mechanics::from_toml("[press]\nobject = \"tape\"\nrow = 4.5\ncol = 4.5", ".".as_ref())?;
/// assert!(middle.overhang().is_none());
/// let beside = Mechanics::from_toml("[press]\nobject = \"tape\"\nrow = 0.0\ncol = 4.5", ".".as_ref())?;
/// assert!(beside.overhang().expect("reaches over the edge").first_row_m > 1e-3);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overhang {
    /// Beyond the edge at row 0.
    pub first_row_m: f64,
    /// Beyond the edge at the last row.
    pub last_row_m: f64,
    /// Beyond the edge at column 0.
    pub first_col_m: f64,
    /// Beyond the edge at the last column.
    pub last_col_m: f64,
}

/// An overhang that is not worth a word, m.
const NEGLIGIBLE_M: f64 = 1e-4;

impl Overhang {
    /// The largest of the four, m.
    pub(crate) fn largest_m(&self) -> f64 {
        self.edges().into_iter().map(|(_, m)| m).fold(0.0, f64::max)
    }

    /// The edges by name, with the overhang over each, m.
    pub fn edges(&self) -> [(&'static str, f64); 4] {
        [
            ("row 0", self.first_row_m),
            ("the last row", self.last_row_m),
            ("column 0", self.first_col_m),
            ("the last column", self.last_col_m),
        ]
    }
}

impl Mechanics {
    /// Overhang of the part of the body that is below the free surface at the target force, or at the deepest point of
    /// a drop; `None` if it is less than 0.1 mm. The scatter of presses is not included.
    pub fn overhang(&self) -> Option<Overhang> {
        let (body, _) = self.contact_body();
        let depth_m = match self.task() {
            Task::Press(press) => self.depth_curve().depth_m(press.force_n),
            Task::Drop(_) => self.depth_curve().depth_m(f64::INFINITY),
        };
        let [low_m, _] = body.heights_m();
        let top_m = low_m + depth_m;
        let turned: Vec<[f64; 3]> = body.mesh.vertices.iter().map(|v| rotated(&body.rotation, v)).collect();
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut reach = |[x, y]: [f64; 2]| {
            for (axis, at) in [x, y].into_iter().enumerate() {
                least[axis] = least[axis].min(at);
                most[axis] = most[axis].max(at);
            }
        };
        for triangle in &body.mesh.triangles {
            let corners = triangle.map(|k| turned[k as usize]);
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if a[2] <= top_m {
                    reach([a[0], a[1]]);
                }
                if (a[2] <= top_m) != (b[2] <= top_m) {
                    let s = (top_m - a[2]) / (b[2] - a[2]);
                    reach([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
                }
            }
        }
        let [width_m, height_m] = self.skin().extent_m();
        let [x, y, _] = body.position_m;
        let over = |beyond_m: f64| beyond_m.max(0.0);
        let overhang = Overhang {
            first_row_m: over(y + most[1] - 0.5 * height_m),
            last_row_m: over(-(y + least[1]) - 0.5 * height_m),
            first_col_m: over(-(x + least[0]) - 0.5 * width_m),
            last_col_m: over(x + most[0] - 0.5 * width_m),
        };
        (overhang.largest_m() > NEGLIGIBLE_M).then_some(overhang)
    }
}

fn rotated(rotation: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use crate::fidelity::{FidelityLevel, Tolerance, measured};
    use crate::mechanics::Mechanics;
    use crate::world::World;
    use std::path::Path;

    fn scene(text: &str) -> Result<Mechanics, String> {
        Mechanics::from_toml(text, Path::new("")).map_err(|e| e.to_string())
    }

    /// Error of the taxels' pressures of the first press over those of another scene of the same frames.
    fn error(found: &Mechanics, expected: &Mechanics) -> f64 {
        let frames = |scene| -> Vec<_> { World::new(scene).unwrap().frames().map(Result::unwrap).collect() };
        let (found, expected) = (frames(found), frames(expected));
        assert!(found.len().abs_diff(expected.len()) <= 1);
        let (mut off, mut all) = (0.0, 0.0);
        for (a, b) in found.iter().zip(&expected) {
            for (p, q) in a.pressure.values().iter().zip(b.pressure.values()) {
                off += (p - q).powi(2);
                all += q * q;
            }
        }
        (off / all).sqrt()
    }

    /// A tolerance is kept against the layer on 24 cells a taxel, with the error that was expected; the scene says its
    /// contact, and is the same when it is read again. A round and a flat object, and a thin one on thinner foam.
    #[test]
    fn a_tolerance_is_kept() {
        for (foam, object) in [("", "tennis"), ("", "T"), ("thickness_m = 0.002\n", "X")] {
            let text = |head: &str, contact: &str| {
                format!("{head}\n[contact]\n{contact}\n{foam}[press]\nobject = \"{object}\"")
            };
            let finest = "model = \"layer\"\ncells_per_taxel = 24";
            let finest = scene(&text("timestep_s = \"auto\"", finest)).unwrap();
            for tolerance in [0.05, 0.3] {
                let scene = scene(&text(&format!("tolerance = {tolerance}"), "")).unwrap();
                let config = scene.config();
                let (expected, found) = (config.chosen.unwrap().error, error(&scene, &finest));
                assert!(found <= tolerance && found <= 1.1 * expected + 0.01, "{object} {foam}: {found}, {expected}");
                assert_eq!(
                    (config.tolerance, config.chosen_for_tolerance),
                    (None, Some(Tolerance::Pressure(tolerance)))
                );
                let again = Mechanics::from_toml(&scene.to_toml().unwrap(), Path::new("")).unwrap();
                assert_eq!(again.config(), config);
            }
        }
    }

    /// Every line of the shipped table reads, and names a level; the reference is in it for both kinds of scene.
    #[test]
    fn the_shipped_table_is_whole() {
        let lines = include_str!("../../assets/fidelity.csv").lines().count();
        assert_eq!(measured().len(), lines - 1);
        assert!(measured().iter().all(|row| FidelityLevel::named(&row.level).is_some()));
    }

    /// Squares are no larger than those of the usual pitch.
    #[test]
    fn a_larger_pitch_gets_more_cells() {
        let head = "tolerance = 0.3\n[press]\nobject = \"T\"\n[skin]\n";
        let cells =
            |skin: &str| scene(&format!("{head}{skin}")).unwrap().config().contact["cells_per_taxel"].as_integer();
        assert_eq!(cells("pitch_m = 0.03\nelectrode_m = 0.02"), cells("").map(|cells| 2 * cells));
    }

    /// The field at the pose of a frame on the plateau, where nothing moves, gives the frame's force again: to the
    /// remaining motion, below 0.01 mm/s · 0.5 ms of damping in 1 mm of depth.
    #[test]
    fn a_frame_can_be_looked_at_again() {
        let scene = Mechanics::press("T").unwrap();
        let mut world = World::new(&scene).unwrap();
        let frame = world.frames().map(Result::unwrap).find(|f| f.time_s > 0.9).unwrap();
        let mut field = scene.build_contact().unwrap();
        let force_n = field.respond(&scene.posed(&frame.pose)).wrench.force_n[2];
        approx::assert_relative_eq!(force_n, frame.wrench.force_n[2], max_relative = 1e-4);
    }
}
