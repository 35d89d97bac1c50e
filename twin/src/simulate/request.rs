//! Turns a request of the command line into a valid scene that can be stored and run again, with notes for the user.

use crate::chain::MAX_TOML_BYTES;
use crate::record::header;
use crate::scene::{Assignment, Scene, SceneConfig, Task, not_text, unwritable};
use crate::session::Session;
use spts_circuit::Mode;
use spts_contact::mesh::{MAX_FILE_BYTES, MeshReport};
use spts_input::{InputError, Refusal};
use spts_models::REFERENCE_PA;
use spts_sim::fidelity::LEVELS;
use spts_sim::mechanics::{FLIGHT_INTERVAL_S, Mechanics};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Maps of a frame in files: pressure, electrode pressure and conductance.
const MAPS: f64 = 3.0;
/// Bytes of a line of `frames.csv`.
const FRAME_LINE: f64 = 230.0;

/// A request to simulate: a scene by name or file, and the changes to it.
///
/// ```
/// use spts::simulate::Request;
///
/// let request = Request { scene: "press/T".to_owned(), assignments: vec!["press.force_n=12".parse()?] };
/// let prepared = request.prepare()?;
/// assert_eq!(prepared.scene.name(), "T");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// `press/NAME`, `press` (with a mesh), `bounce`, one of [`NAMED_SCENES`], or a file that ends in `.toml`. `press`
    /// and `bounce` have one press or drop.
    pub scene: String,
    /// Changes, in order. Files are looked up in the current folder.
    pub assignments: Vec<Assignment>,
}

/// Scenes that ship as files: name and TOML.
pub const NAMED_SCENES: &[(&str, &str)] = &[("arm", include_str!("arm.toml"))];

/// A scene that has been read and checked and is ready to be simulated, with the files that belong to it.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// The scene as TOML with all defaults filled in. Files have the names of [`Prepared::copies`].
    pub scene_toml: String,
    /// Hash of the scene.
    pub scene_hash: String,
    /// Files that the scene needs beside it: names and contents.
    pub copies: Vec<(String, Vec<u8>)>,
    /// Notes for the user, such as repairs of a mesh. The notes do not name the mesh, so that they are the same when
    /// its copy is simulated.
    pub notes: Vec<String>,
}

impl Prepared {
    /// What touches the skin: the name of the object, `mesh`, or `ball`.
    pub fn body(&self) -> &str {
        match self.scene.task() {
            Task::Press(press) if !press.objects.is_empty() => self.scene.name(),
            Task::Press(press) => press.object.as_deref().unwrap_or("mesh"),
            Task::Drop(_) => "ball",
        }
    }

    /// Bytes of the files of a run without its few pictures, with its recordings if it has them. Of a drop they are the
    /// least: frames are closer than in flight while the ball touches.
    pub fn bytes(&self, record: bool) -> u64 {
        let (scene, mechanics) = (&self.scene, self.scene.mechanics());
        let chain = scene.chain();
        let between_s = match scene.task() {
            Task::Press(_) => mechanics.frame_interval_s(),
            Task::Drop(_) => mechanics.frame_interval_s().max(FLIGHT_INTERVAL_S),
        };
        let frames = scene.duration_s() / between_s;
        let samples = if record { scene.duration_s() * chain.sample_rate_hz() } else { 0.0 };
        let code = |mode| {
            let converter = chain.profile().converter(mode).ok().flatten();
            converter.map_or(size_of::<f64>(), |converter| converter.code_bytes()) as f64
        };
        let map = MAPS * size_of::<f64>() as f64 * scene.skin().taxels() as f64;
        let modes = [Mode::Compressive, Mode::Raster].into_iter().filter(|mode| chain.check(*mode).is_ok());
        let press = frames * (map + FRAME_LINE) + samples * modes.map(code).sum::<f64>();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let bytes = (press * scene.repeats() as f64) as u64;
        bytes
    }

    /// The session of the run, without its recordings.
    pub fn session(&self) -> Session {
        header(&self.scene, &self.scene_hash)
    }
}

impl Request {
    /// The scene, valid and with its changes.
    ///
    /// # Errors
    /// [`Refusal`], which names the file or option, the value, and what is valid.
    pub fn scene(&self) -> Result<Scene, Refusal> {
        let mut table = self.start()?;
        Assignment::apply_all(&self.assignments, &mut table)?;
        let scene = SceneConfig::from_table(table).and_then(|config| Scene::new(config, Path::new("")));
        scene.map_err(|error| match is_toml(&self.scene) {
            true => error.at(&self.scene),
            false => error,
        })
    }

    /// Checks everything that can be checked before the first step.
    ///
    /// # Errors
    /// As [`Request::scene`].
    pub fn prepare(&self) -> Result<Prepared, Refusal> {
        let scene = self.scene()?;
        let portable = scene.portable();
        let mut copies = Vec::new();
        if let (Some(file), Some(name)) = (scene.chain().profile_file(), &portable.readout) {
            copies.push((name.clone(), file.text.clone().into_bytes()));
        }
        let rows = portable.rows.seeds_file.as_ref().or(portable.rows.patterns_file.as_ref());
        if let (Some(file), Some(name)) = (scene.chain().rows_file(), rows) {
            copies.push((name.clone(), file.text.clone().into_bytes()));
        }
        let mesh = |config: &SceneConfig| config.press.as_ref().and_then(|press| press.mesh.clone());
        if let (Some(file), Some(name)) = (mesh(scene.config()), mesh(&portable)) {
            let path = Path::new(&file);
            let bytes = spts_input::read(path, MAX_FILE_BYTES).map_err(unreadable(path))?;
            copies.push((name, bytes));
        }
        Ok(Prepared {
            scene_hash: scene.hash()?,
            scene_toml: toml::to_string(&portable).map_err(unwritable)?,
            notes: notes_on(&scene)?,
            scene,
            copies,
        })
    }

    /// The scene before anything is changed in it, with the folder of the scene file before the names of the files that
    /// it needs.
    fn start(&self) -> Result<Table, Refusal> {
        let mesh = self.assignments.iter().find(|assignment| assignment.sets("press.mesh"));
        let once = |section: &str, entries: &[(&str, Value)]| {
            let section =
                (section.to_owned(), Value::Table(entries.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect()));
            Ok([section].into_iter().collect())
        };
        if is_toml(&self.scene) {
            return self.read_scene();
        }
        if let Some((_, text)) = NAMED_SCENES.iter().find(|(name, _)| *name == self.scene) {
            // a test reads all of them
            return Ok(toml::from_str(text).unwrap_or_default());
        }
        match (self.scene.split_once('/'), mesh) {
            (Some(("press", _)), Some(mesh)) => {
                let reason =
                    format!("a mesh takes the place of the object: write `press` in place of `{}`", self.scene);
                Err(mesh.refused(reason))
            }
            (Some(("press", object)), None) => once("press", &[("object", object.into()), ("presses", 1.into())]),
            (None, Some(_)) if self.scene == "press" => once("press", &[("presses", 1.into())]),
            (None, _) if self.scene == "bounce" => once("drop", &[("drops", 1.into())]),
            _ => Err(Refusal::new(format!(
                "SCENE = \"{}\" is not press/NAME, press with --mesh, bounce, arm, or a file that ends in .toml",
                self.scene
            ))),
        }
    }

    /// The scene file.
    fn read_scene(&self) -> Result<Table, Refusal> {
        let path = Path::new(&self.scene);
        let text = spts_input::read_text(path, MAX_TOML_BYTES).map_err(unreadable(path))?;
        let parsed = SceneConfig::from_toml(&text).map_err(|error| error.at(path.display()))?;
        // it is TOML, or it would not have been a scene
        let mut table: Table = toml::from_str(&text).unwrap_or_default();
        let folder = path.parent().unwrap_or(Path::new(""));
        if let (Some(readout), Some(Value::String(value))) = (&parsed.readout, table.get_mut("readout"))
            && is_toml(readout)
        {
            *value = utf8(folder.join(readout))?;
        }
        let named = [("seeds_file", &parsed.rows.seeds_file), ("patterns_file", &parsed.rows.patterns_file)];
        for (key, name) in named {
            if let (Some(name), Some(Value::Table(rows))) = (name, table.get_mut("rows")) {
                rows.insert(key.to_owned(), utf8(folder.join(name))?.into());
            }
        }
        if let (Some(mesh), Some(Value::Table(press))) = (parsed.press.and_then(|p| p.mesh), table.get_mut("press")) {
            press.insert("mesh".to_owned(), utf8(folder.join(mesh))?.into());
        }
        let renamed = ["press.mesh", "press.object"];
        if !self.assignments.iter().any(|a| renamed.iter().any(|key| a.sets(key))) {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            table.entry("name").or_insert(stem.into());
        }
        Ok(table)
    }
}

fn is_toml(text: &str) -> bool {
    Path::new(text).extension().is_some_and(|e| e == "toml")
}

fn utf8(path: PathBuf) -> Result<String, Refusal> {
    let text = path.into_os_string().into_string();
    text.map_err(|path| not_text(path.as_ref()))
}

/// The error of the file at `path`, which cannot be read.
fn unreadable(path: &Path) -> impl Fn(InputError) -> Refusal {
    move |error| Refusal::from_error(error).at("cannot be read").at(path.display())
}

/// Notes on `scene`: what was repaired in its mesh, what hangs over the edge, what a tolerance chose, faults, and a
/// taxel that is below the noise.
fn notes_on(scene: &Scene) -> Result<Vec<String>, Refusal> {
    let mechanics = scene.mechanics();
    let mut notes = mechanics.mesh_report().map(MeshReport::notes).unwrap_or_default();
    notes.extend(overhang(mechanics));
    notes.extend(chosen(mechanics));
    let cols = scene.skin().cols();
    notes.extend(scene.chain().profile().faults.iter().map(|fault| {
        let taxel = fault.taxel as usize;
        format!("injected fault: `{}`, taxel {taxel} (row {}, column {})", fault.name, taxel / cols, taxel % cols)
    }));
    notes.extend(below_noise(scene)?);
    Ok(notes)
}

fn overhang(mechanics: &Mechanics) -> Option<String> {
    let edges = mechanics.overhang()?.edges();
    let over = edges.iter().filter(|(_, m)| *m > 0.0);
    let over: Vec<String> = over.map(|(edge, m)| format!("{:.1} mm over the edge at {edge}", 1e3 * m)).collect();
    let what = match mechanics.task() {
        Task::Press(_) => "object",
        Task::Drop(_) => "ball",
    };
    Some(format!("the {what} hangs {}: beside the sheet there is nothing to press on", over.join(", ")))
}

fn chosen(mechanics: &Mechanics) -> Option<String> {
    let config = mechanics.config();
    let tolerance = config.chosen_for_tolerance?;
    let of = |key: &str| config.contact.get(key).map(ToString::to_string).unwrap_or_default();
    let coupled = config.contact.get("coupled").and_then(Value::as_bool);
    let model = config.contact.get("model").and_then(Value::as_str).unwrap_or_default();
    let level = LEVELS.iter().find(|level| level.model == model && level.coupled == coupled);
    let expected = config.chosen.map(|expected| {
        let task = if matches!(mechanics.task(), Task::Drop(_)) { "drop" } else { "press" };
        let beyond = if expected.finest_error > tolerance.pressure(task).unwrap_or_default() {
            let converged =
                "the finest grid has not converged on this contact: halving its cells moved the pressures by";
            format!("; {converged} {:.3}", expected.finest_error)
        } else {
            String::new()
        };
        format!(
            ", with an expected error of the pressures of {:.3}; the finest takes {:.0} times as long{beyond}",
            expected.error, expected.saves
        )
    });
    Some(format!(
        "the tolerance of {tolerance} chose the contact field {model:?}, {} cells along a taxel and steps of {} s{}; left out: {}",
        of("cells_per_taxel"),
        mechanics.timestep_s(),
        expected.unwrap_or_default(),
        level.map_or("nothing", |level| level.leaves_out)
    ))
}

fn below_noise(scene: &Scene) -> Result<Option<String>, Refusal> {
    let signal = scene.chain().taxel_signal()?;
    Ok(signal.below_noise().then(|| {
        format!(
            "a taxel under {:.0} kPa gives {:.2e} V, a measurement has a noise of {:.2e} V and steps of {:.2e} V: the taxel is below the noise. An electrode of \
             {:.1} mm needs more feedback than the readout profile has",
            1e-3 * REFERENCE_PA,
            signal.signal_v,
            signal.noise_v,
            signal.step_v,
            1e3 * scene.skin().electrode_m()
        )
    }))
}
