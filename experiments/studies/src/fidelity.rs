//! `spts fidelity`: cost and error of every fidelity level of the contact, up to the error of the scores.
//!
//! Every scene is run with every level, at several resolutions and time steps, and compared with the reference level
//! at its finest: pressures and, after transducer, readout and decoder, scores.

use rayon::prelude::*;
use serde::Serialize;
use spts::chain::Acquisition;
use spts::output::write_bytes;
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::scene::{DropConfig, PressConfig, Scene, SceneConfig, Task, Timestep, Tolerance};
use spts_circuit::Mode;
use spts_contact::Frame;
use spts_contact::mesh::{TriMesh, cylinder, extrude, sphere};
use spts_eval::decoders::{TrainedDecoder, published};
use spts_eval::training::Learned;
use spts_eval::{Scorer, Tally, Untouched, Window, wire_means};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::dictionary::{Ksvd, Selection, select};
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use spts_sim::World;
use spts_sim::fidelity::{FidelityLevel, LEVELS, MeasuredSetting, REFERENCE, finest};
use spts_sim::world::{Bounce, no_pressure};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Settings of `spts fidelity`, which measures cost and error of every contact model, resolution and time step.
#[derive(Debug, Clone)]
pub struct FidelityStudy {
    /// Names of built-in scenes, or scene files; empty for all built-in ones.
    pub scenes: Vec<String>,
    /// Taxels along a side of the skin of built-in scenes, which is as large as the published one.
    pub side: usize,
    /// Levels, resolutions and time steps.
    pub grid: SettingGrid,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A setting of a scene that could not be run, and why.
#[derive(Debug, Clone, Serialize)]
pub struct RefusedSetting {
    /// Name of the scene.
    pub scene: String,
    /// Name of the fidelity level.
    #[serde(rename = "rung")]
    pub level: &'static str,
    /// Fine cells along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Time step of the dynamics, s.
    pub timestep_s: f64,
    /// Why.
    pub reason: String,
}

/// The reference of one scene: the press or drop that is learned from, and the one that is compared.
struct Reference {
    scene: FidelityScene,
    at_reference: Scene,
    learned: ContactRun,
    scored: ContactRun,
}

impl FidelityStudy {
    /// Runs every scene with every setting. Meshes that only this study uses are written to the folder `meshes`, which
    /// must exist.
    ///
    /// # Errors
    /// [`Refusal`] if a scene is not usable, a reference cannot be run, or a mesh cannot be written.
    pub fn run(&self, meshes: &Path, progress: &dyn Progress) -> Result<FidelityReport, Refusal> {
        let scenes = build(&self.scenes, self.side, self.seed, meshes)?;
        let runs: usize = scenes.iter().map(|s| self.grid.settings(s.is_drop()).len()).sum();
        progress.stage("running contact models", Some(scenes.len() + runs));
        let references = scenes
            .into_par_iter()
            .map(|scene| {
                let at_reference = scene.at(self.grid.reference(scene.is_drop()))?;
                let run = |index, runs| run_contact(&at_reference, index, runs);
                let (learned, scored) = (run(0, ONCE), run(1, TIMED));
                progress.step();
                Ok(Reference { learned: learned?, scored: scored?, at_reference, scene })
            })
            .collect::<Result<Vec<_>, Refusal>>()?;
        let others = others(&references, self.side, self.seed, meshes)?.into_par_iter();
        let others = others.filter_map(|scene| run_contact(&scene, 0, ONCE).ok().map(|run| (scene, run)));
        let learned = ReferenceScores::learn(&references, &others.collect::<Vec<_>>(), self.seed)?;
        let jobs: Vec<(usize, ContactSetting)> = (0..references.len())
            .flat_map(|i| {
                let settings = self.grid.settings(references[i].scene.is_drop());
                settings.into_iter().map(move |setting| (i, setting))
            })
            .collect();
        let results = jobs.into_par_iter().map(|(i, setting)| {
            let result = measure(&references[i], i, setting, &learned)?;
            progress.step();
            Ok((i, result))
        });
        let results = results.collect::<Result<Vec<_>, Refusal>>()?;
        progress.end();
        let (mut measured, mut refusals) = (Vec::new(), Vec::new());
        for (i, result) in results {
            match result {
                Ok(found) => measured.push((i, found)),
                Err(refusal) => refusals.push(refusal),
            }
        }
        measured.extend(references.iter().enumerate().map(|(i, reference)| {
            let setting = self.grid.reference(reference.scene.is_drop());
            let (scored, took_s) = (&reference.scored, learned.references[i].1);
            (i, row(reference, scored, setting, taxel_error(scored, scored), ([0.0; 3], took_s)))
        }));
        // scene by scene, levels from cheap to dear, then resolution and step
        measured.sort_by_key(|(i, (row, _))| {
            let level = LEVELS.iter().position(|level| level.name == row.level);
            (*i, level, row.cells_per_taxel, row.timestep_s.to_bits())
        });
        let (rows, fine) = measured.into_iter().map(|(_, found)| found).unzip();
        // what every other setting follows from
        let hashes = references.iter().map(|r| r.at_reference.hash());
        let hash = combined_hash(&hashes.collect::<Result<Vec<_>, Refusal>>()?);
        Ok(FidelityReport { rows, refusals, fine, provenance: Provenance::new(self.seed, hash) })
    }
}

/// A line of the table, and the pressure that it is of.
type Measured = (MeasuredSetting, FinePressure);

/// Runs one setting of the scene with the index `label` and compares it with its reference.
fn measure(
    reference: &Reference,
    label: usize,
    setting: ContactSetting,
    learned: &ReferenceScores,
) -> Result<Result<Measured, RefusedSetting>, Refusal> {
    let run = || {
        let scene = reference.scene.at(setting)?;
        let found = run_contact(&scene, 1, TIMED)?;
        let taxel_rms_rel = taxel_error(&found, &reference.scored);
        if taxel_rms_rel.is_finite() {
            return Ok((scene, found, taxel_rms_rel));
        }
        Err(Refusal::new("the ball meets nothing, or the reference nothing like it"))
    };
    let (scene, found, taxel_rms_rel) = match run() {
        Ok(found) => found,
        Err(refusal) => {
            return Ok(Err(RefusedSetting {
                scene: reference.scene.name.clone(),
                level: setting.level.name,
                cells_per_taxel: setting.cells_per_taxel,
                timestep_s: setting.timestep_s,
                reason: refusal.to_string(),
            }));
        }
    };
    let ((scores, took_s), (truth, _)) = (learned.score(&scene, &found, label)?, learned.references[label]);
    let deltas = [0, 1, 2].map(|k| scores[k] - truth[k]);
    Ok(Ok(row(reference, &found, setting, taxel_rms_rel, (deltas, took_s))))
}

/// The line of the table for `found`, with the error of the taxels' pressures, the changes of support accuracy, IoU and
/// classification, and the time that recording and decoding took, s.
fn row(
    reference: &Reference,
    found: &ContactRun,
    setting: ContactSetting,
    taxel_rms_rel: f64,
    ([support_delta, iou_delta, class_delta], took_s): (ChainScores, f64),
) -> Measured {
    let row = MeasuredSetting {
        scene: reference.scene.name.clone(),
        task: if reference.scene.is_drop() { "drop" } else { "press" }.to_owned(),
        level: setting.level.name.to_owned(),
        cells: format!("{}x{}", found.fine.rows, found.fine.cols),
        cells_per_taxel: setting.cells_per_taxel,
        timestep_s: setting.timestep_s,
        cost_us_per_step: found.cost_us_per_step,
        cost_s_per_s: found.cost_s_per_s,
        chain_s: found.cost_s_per_s * reference.at_reference.duration_s() + took_s,
        pressure_rms_rel: fine_error(&found.fine, &reference.scored.fine),
        taxel_rms_rel,
        support_delta,
        iou_delta,
        class_delta,
    };
    (row, found.fine.clone())
}

/// Resolutions and time steps at which `spts fidelity` runs every contact model.
///
/// ```
/// use spts_studies::fidelity::SettingGrid;
///
/// let (quick, full) = (SettingGrid::quick(), SettingGrid::full());
/// assert!(quick.cells_per_taxel.len() <= full.cells_per_taxel.len());
/// assert!(full.reference_cells > *full.cells_per_taxel.first().expect("resolutions"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SettingGrid {
    /// Resolutions: grid squares along one side of a taxel.
    pub cells_per_taxel: Vec<usize>,
    /// Time steps of a press, s.
    pub press_steps_s: Vec<f64>,
    /// Time steps of a drop, s.
    pub drop_steps_s: Vec<f64>,
    /// Resolution of the reference.
    pub reference_cells: usize,
}

/// A level at a resolution and a time step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ContactSetting {
    level: &'static FidelityLevel,
    cells_per_taxel: usize,
    timestep_s: f64,
}

/// Taxels along a side of the published skin.
const PUBLISHED_SIDE: usize = 10;
/// Squares along a side of the finest grid of other skins.
const MOST_SQUARES_A_SIDE: usize = 384;

/// Time between the frames of a press, s: the one step of a level without dynamics.
const FRAME_S: f64 = 2e-3;

impl SettingGrid {
    /// The settings of the shipped table.
    pub fn full() -> Self {
        Self {
            cells_per_taxel: vec![2, 3, 6, 12, 24],
            press_steps_s: vec![2.5e-4, 5e-4, 1e-3, 2e-3],
            drop_steps_s: vec![5e-5, 1e-4, 2e-4],
            reference_cells: 24,
        }
    }

    /// The settings of a skin of `side` × `side` taxels: those of the shipped table for the published one; for others
    /// as many squares a taxel as keep the grid within 384 a side, at the default steps.
    pub fn of(side: usize) -> Self {
        let full = Self::full();
        if side == PUBLISHED_SIDE {
            return full;
        }
        let reference_cells = Self::most_cells(side);
        let mut cells = full.cells_per_taxel;
        cells.retain(|cells| *cells <= reference_cells);
        Self { cells_per_taxel: cells, press_steps_s: vec![5e-4], drop_steps_s: vec![1e-4], reference_cells }
    }

    /// Most squares along one side of a taxel on a skin of `side` × `side`.
    pub fn most_cells(side: usize) -> usize {
        let most = Self::full().reference_cells;
        if side == PUBLISHED_SIDE { most } else { (MOST_SQUARES_A_SIDE / side.max(1)).clamp(1, most) }
    }

    /// Settings that take less than a minute.
    pub fn quick() -> Self {
        Self { cells_per_taxel: vec![2, 6], press_steps_s: vec![5e-4], drop_steps_s: vec![1e-4], reference_cells: 6 }
    }

    fn steps_s(&self, drop: bool) -> &[f64] {
        if drop { &self.drop_steps_s } else { &self.press_steps_s }
    }

    /// The reference: its level at its finest.
    fn reference(&self, drop: bool) -> ContactSetting {
        ContactSetting {
            level: FidelityLevel::named(REFERENCE).unwrap_or(&LEVELS[0]),
            cells_per_taxel: self.reference_cells,
            timestep_s: self.steps_s(drop).iter().copied().fold(f64::INFINITY, f64::min),
        }
    }

    /// Everything that is compared with the reference: that itself is left out, and a drop has no level without
    /// dynamics.
    fn settings(&self, drop: bool) -> Vec<ContactSetting> {
        let mut settings = Vec::new();
        for level in LEVELS {
            let steps_s = if level.dynamic { self.steps_s(drop) } else { &[FRAME_S] };
            if drop && !level.dynamic {
                continue;
            }
            for &cells_per_taxel in &self.cells_per_taxel {
                settings.extend(steps_s.iter().map(|&timestep_s| ContactSetting {
                    level,
                    cells_per_taxel,
                    timestep_s,
                }));
            }
        }
        settings.retain(|setting| *setting != self.reference(drop));
        settings
    }
}

/// Names of the built-in scenes.
pub const SCENES: [&str; 7] = ["sphere", "punch", "edge", "T", "tape", "comb", "drop"];

/// A scene of the study, to be run with any level.
#[derive(Debug, Clone)]
pub(crate) struct FidelityScene {
    /// Name in the table.
    pub name: String,
    config: SceneConfig,
    folder: PathBuf,
}

/// Presses or drops of a scene: one to learn from and one to score.
const REPEATS: usize = 2;

impl FidelityScene {
    /// Whether the scene is a drop.
    pub(crate) fn is_drop(&self) -> bool {
        self.config.drop.is_some()
    }

    /// The scene on a level.
    fn at(&self, setting: ContactSetting) -> Result<Scene, Refusal> {
        let mut config = self.config.clone();
        setting.level.apply(&mut config.contact, setting.cells_per_taxel);
        config.timestep_s = Some(setting.timestep_s.into());
        Scene::new(config, &self.folder)
    }
}

/// The built-in scenes called `names`, or read from files; all built-in ones when there is no name. Meshes that only
/// the study has are written to `folder`.
fn build(names: &[String], side: usize, seed: u64, folder: &Path) -> Result<Vec<FidelityScene>, Refusal> {
    let all: Vec<String> = SCENES.iter().map(|&name| name.to_owned()).collect();
    let names = if names.is_empty() { &all } else { names };
    let mut scenes: Vec<FidelityScene> = Vec::new();
    for name in names {
        let scene = if Path::new(name).extension().is_some_and(|e| e == "toml") {
            from_file(Path::new(name))?
        } else {
            built_in(name, side, seed, folder)?
        };
        if scenes.iter().any(|s| s.name == scene.name) {
            return Err(Refusal::new(format!("`--scene {name}`: named twice")));
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

/// What else might be pressed: the built-in scenes that were not asked for, with everything at its default but the
/// skin, which is that of the references. Those that such a skin cannot bear are left out.
fn others(references: &[Reference], side: usize, seed: u64, folder: &Path) -> Result<Vec<Scene>, Refusal> {
    let Some(first) = references.first() else {
        return Ok(Vec::new());
    };
    let skin = *first.at_reference.skin();
    if let Some(other) = references.iter().find(|r| *r.at_reference.skin() != skin) {
        return Err(Refusal::new(format!(
            "`--scene`: `{}` and `{}` have different skins; study them one at a time",
            first.scene.name, other.scene.name
        )));
    }
    let left = SCENES.iter().filter(|name| references.iter().all(|r| r.scene.name != **name));
    let scenes = left.map(|name| {
        let config = SceneConfig { skin, ..built_in(name, side, seed, folder)?.config };
        Ok(Scene::new(config, folder).ok())
    });
    scenes.filter_map(Result::transpose).collect()
}

/// A built-in scene on `side` × `side` taxels.
fn built_in(name: &str, side: usize, seed: u64, folder: &Path) -> Result<FidelityScene, Refusal> {
    let published = SkinLayout::default();
    let pitch_m = published.pitch_m() * PUBLISHED_SIDE as f64 / side as f64;
    let skin = if side == PUBLISHED_SIDE { published } else { SkinLayout::with_pitch(side, side, pitch_m)? };
    let mut press = PressConfig { presses: REPEATS, ..PressConfig::default() };
    let mut ball = None;
    match name {
        "T" | "tape" | "comb" => press.object = Some(name.to_owned()),
        "drop" => {
            ball = Some(DropConfig {
                drops: REPEATS,
                // one bounce from the full height, and the start of the next
                duration_s: 0.7,
                ..DropConfig::default()
            });
        }
        _ => {
            let Some(mesh) = shape(name) else {
                return Err(Refusal::new(format!(
                    "`--scene {name}` is not one of {}, or a file that ends in .toml",
                    SCENES.join(", ")
                )));
            };
            let file = format!("{name}.obj");
            write_bytes(&folder.join(&file), mesh.to_obj(name).as_bytes())?;
            press.mesh = Some(file);
            [press.row, press.col] = PLACE.map(|at| Some((at + 0.5) * published.pitch_m() / pitch_m - 0.5));
            press.rotation_deg = Some(ROTATION_DEG);
        }
    }
    Ok(FidelityScene {
        name: name.to_owned(),
        config: SceneConfig {
            seed,
            press: ball.is_none().then_some(press),
            drop: ball,
            skin,
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
fn from_file(path: &Path) -> Result<FidelityScene, Refusal> {
    let scene = Scene::load(path)?;
    let mut config = scene.config().clone();
    match scene.task() {
        Task::Press(press) => {
            config.press = Some(PressConfig { presses: REPEATS, ..press.clone() });
        }
        Task::Drop(ball) => {
            config.drop = Some(DropConfig { drops: REPEATS, ..ball.clone() });
        }
    }
    // the levels bring their own
    config.frame_interval_s = None;
    Ok(FidelityScene {
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        config,
        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
    })
}

/// Pressure on every square of the grid on which contact is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct FinePressure {
    /// Rows of the grid.
    pub rows: usize,
    /// Columns of the grid.
    pub cols: usize,
    /// Pressure on every square, Pa, row-major.
    pub pressure_pa: Vec<f64>,
}

/// What one run gave.
#[derive(Debug, Clone)]
pub(crate) struct ContactRun {
    frames: Vec<Frame>,
    bounces: Vec<Bounce>,
    fine: FinePressure,
    /// Span of the scores, s: plateau of a press, first contact of a drop.
    span_s: [f64; 2],
    cost_us_per_step: f64,
    cost_s_per_s: f64,
}

/// Runs that are needed when nobody asks for the cost, and those that are timed at most.
const ONCE: usize = 1;
const TIMED: usize = 5;
/// Time after which no further run is started, s.
const ENOUGH_S: f64 = 0.3;

/// Runs press or drop `index` of `scene`. The cost is that of the quickest of at most `most_runs` runs, set-up
/// included; long runs are made once.
pub(crate) fn run_contact(scene: &Scene, index: usize, most_runs: usize) -> Result<ContactRun, Refusal> {
    let (mut least_s, mut spent_s) = (f64::INFINITY, 0.0);
    let mut last = None;
    for _ in 0..most_runs {
        let start = Instant::now();
        let mut world = World::repeat(scene.mechanics(), index)?;
        let frames = world.frames().collect::<Result<Vec<Frame>, _>>()?;
        let wall_s = start.elapsed().as_secs_f64();
        last = Some((frames, world.bounces().to_vec()));
        least_s = wall_s.min(least_s);
        spent_s += wall_s;
        if spent_s > ENOUGH_S {
            break;
        }
    }
    let (frames, bounces) = last.unwrap_or_default();
    let span_s = match scene.task() {
        Task::Press(press) => press.plateau_s(),
        Task::Drop(_) => bounces.first().map_or([0.0, scene.duration_s()], |b| {
            // the ends, where hardly anything touches, say little about the shape
            [b.start_s + 0.15 * b.contact_s, b.start_s + 0.85 * b.contact_s]
        }),
    };
    Ok(ContactRun {
        fine: fine(scene, &frames, span_s)?,
        bounces,
        span_s,
        cost_us_per_step: 1e6 * least_s * scene.mechanics().timestep_s() / scene.duration_s(),
        cost_s_per_s: least_s / scene.duration_s(),
        frames,
    })
}

/// Fine pressure in the middle of the span.
fn fine(scene: &Scene, frames: &[Frame], [start_s, end_s]: [f64; 2]) -> Result<FinePressure, Refusal> {
    let mut field = scene.mechanics().build_contact()?;
    let cells = field.cells_per_taxel();
    let (rows, cols) = (scene.skin().rows() * cells, scene.skin().cols() * cells);
    let middle_s = 0.5 * (start_s + end_s);
    let Some(frame) = nearest(frames, middle_s).map(|i| &frames[i]) else {
        return Ok(FinePressure { rows, cols, pressure_pa: vec![0.0; rows * cols] });
    };
    let body = scene.mechanics().posed(&frame.pose);
    let mut pressure_pa = field.respond(&body).pressure_pa.to_vec();
    let force_n = frame.wrench.force_n[2];
    if let Some(refined) = field.refine(&body, force_n) {
        pressure_pa.copy_from_slice(refined);
    } else if let Some(reason) = field.failure() {
        return Err(no_pressure(force_n, frame.time_s, &reason));
    }
    Ok(FinePressure { rows, cols, pressure_pa })
}

/// Index of the frame nearest to `time_s`; `None` without a frame.
fn nearest(frames: &[Frame], time_s: f64) -> Option<usize> {
    let after = frames.partition_point(|f| f.time_s < time_s);
    let Some(before) = after.checked_sub(1) else {
        return (!frames.is_empty()).then_some(0);
    };
    let Some(next) = frames.get(after) else {
        return Some(before);
    };
    let nearer = time_s - frames[before].time_s <= next.time_s - time_s;
    Some(if nearer { before } else { after })
}

/// Root mean square of the differences of values from what was expected, relative to that of the expected ones; 0 when
/// nothing was expected and nothing found.
fn relative_rms(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut error, mut reference) = (0.0, 0.0);
    for (value, expected) in pairs {
        error += (value - expected).powi(2);
        reference += expected * expected;
    }
    if error > 0.0 || error.is_nan() { (error / reference).sqrt() } else { 0.0 }
}

/// Error of a fine field on the grid of the reference: every cell of it takes the value of the cell its centre falls
/// into.
fn fine_error(found: &FinePressure, reference: &FinePressure) -> f64 {
    let at = |i: usize, cells: usize, of: usize| (2 * i + 1) * cells / (2 * of);
    relative_rms(reference.pressure_pa.iter().enumerate().map(|(k, expected)| {
        let row = at(k / reference.cols, found.rows, reference.rows);
        let col = at(k % reference.cols, found.cols, reference.cols);
        (found.pressure_pa[row * found.cols + col], *expected)
    }))
}

/// Times at which drops are compared, s: finer than any contact's structure.
const DROP_SAMPLE_S: f64 = 5e-5;

/// Error of the taxels' pressures, over all frames of a press, or over the first contact of a drop, both counted from
/// when the force first passes half its peak: what a step's delay adds to the flight is no error of the contact.
pub(crate) fn taxel_error(found: &ContactRun, reference: &ContactRun) -> f64 {
    // times in the reference and in the run
    let times_s: Vec<(f64, f64)> = match reference.bounces.first() {
        None => reference.frames.iter().map(|frame| (frame.time_s, frame.time_s)).collect(),
        Some(contact) => {
            let (Some(middle_s), Some(found_s)) = (half_rise_s(reference), half_rise_s(found)) else {
                return f64::INFINITY;
            };
            let end_s = contact.start_s + 1.2 * contact.contact_s;
            let samples = std::iter::successors(Some(contact.start_s - DROP_SAMPLE_S), |s| Some(s + DROP_SAMPLE_S));
            let samples = samples.take_while(|time_s| *time_s <= end_s);
            samples.map(|time_s| (time_s, time_s - middle_s + found_s)).collect()
        }
    };
    relative_rms(times_s.into_iter().flat_map(|(expected_s, found_s)| {
        let expected = pressure_at(&reference.frames, expected_s);
        pressure_at(&found.frames, found_s).into_iter().zip(expected)
    }))
}

/// When the force of the first contact passes half its peak, between frames by linear interpolation, s.
fn half_rise_s(run: &ContactRun) -> Option<f64> {
    let half_n = 0.5 * run.bounces.first()?.peak_force_n;
    let force_n = |f: &Frame| f.wrench.force_n[2];
    let pair = run.frames.windows(2).find(|w| force_n(&w[1]) >= half_n)?;
    let share = (half_n - force_n(&pair[0])) / (force_n(&pair[1]) - force_n(&pair[0]));
    Some(pair[0].time_s + share * (pair[1].time_s - pair[0].time_s))
}

/// Pressure of every taxel at `time_s`, between frames by linear interpolation, Pa.
fn pressure_at(frames: &[Frame], time_s: f64) -> Vec<f64> {
    let after = frames.partition_point(|f| f.time_s < time_s);
    let values = |f: &Frame| f.pressure.values().to_vec();
    match (frames.get(after.wrapping_sub(1)), frames.get(after)) {
        // a sample at a frame's own time is that frame, bit for bit
        (_, Some(b)) if b.time_s <= time_s => values(b),
        (Some(a), Some(b)) => {
            let share = (time_s - a.time_s) / (b.time_s - a.time_s);
            let pairs = a.pressure.values().iter().zip(b.pressure.values());
            pairs.map(|(a, b)| a + share * (b - a)).collect()
        }
        (Some(only), None) | (None, Some(only)) => values(only),
        (None, None) => Vec::new(),
    }
}

/// Taxels for one measurement of a window: 20 measurements on 100 taxels.
const TAXELS_PER_MEASUREMENT: usize = 5;
/// Most windows scored of one recording, spread evenly over the span.
const WINDOWS: usize = 300;
/// Library images of a scene.
const LIBRARY_IMAGES: usize = 10;
/// Training images of a scene at most.
const TRAINING_IMAGES: usize = 120;
/// Sweeps of the dictionary learning.
const SWEEPS: usize = 10;
/// Presses that condition the sheet before the one that is recorded.
const PRESSES_BEFORE: usize = 2;
/// Share of the time to the first touch that is idle for sure.
const IDLE: f64 = 0.8;

/// Support accuracy, intersection over union, and share of windows classified correctly.
type ChainScores = [f64; 3];

/// Images of a run: conductance above that of the idle skin, relative to its peak, frame by frame.
type Images = Vec<Vec<f64>>;

/// What every level is scored with: what the decoder has learned, and the truth and the scores of every reference.
struct ReferenceScores {
    decoder: TrainedDecoder,
    truths: Vec<Truth>,
    /// With the time of recording and decoding, s.
    references: Vec<(ChainScores, f64)>,
}

/// The reference of a scene: when its frames were, what was pressed at them, and when the scores are taken.
struct Truth {
    run: ContactRun,
    masks: Vec<Vec<bool>>,
}

impl ReferenceScores {
    /// Learns from the first repeats of the references, and from `others`, which stand for what else might be pressed,
    /// and scores the references' second ones.
    fn learn(references: &[Reference], others: &[(Scene, ContactRun)], seed: u64) -> Result<Self, Refusal> {
        let (mut training, mut library, mut labels) = (Images::new(), Images::new(), Vec::new());
        let known = references.iter().map(|r| (&r.at_reference, &r.learned));
        for (label, (scene, run)) in known.chain(others.iter().map(|(s, r)| (s, r))).enumerate() {
            let images = images(scene, run);
            let stride = images.len().div_ceil(TRAINING_IMAGES).max(1);
            training.extend(images.iter().step_by(stride).cloned());
            let full: Vec<&Vec<f64>> = images.iter().filter(|image| peak(image) > 0.7).collect();
            for k in 0..LIBRARY_IMAGES.min(full.len()) {
                library.push(full[k * full.len() / LIBRARY_IMAGES.min(full.len())].clone());
                labels.push(label);
            }
        }
        let streams = Streams::new(seed);
        // relative to the peak, published thresholds of 0.25 V on images of a few volts become a tenth
        let selection = Selection { min_peak: 0.1, ..Selection::default() };
        let chosen: Images = select(&training, &selection).into_iter().map(|i| training[i].clone()).collect();
        let ksvd = Ksvd { n_iter: SWEEPS, ..Ksvd::default() };
        let nothing = |of: &'static str| move |e: Refusal| Refusal::new(format!("no training data for the {of}: {e}"));
        let dictionary = ksvd.learn(&chosen, &mut streams.rng("ksvd", 0)).map_err(nothing("dictionary"))?;
        let library = Library::new(&Matrix::from_column_slices(dictionary.nrows(), &library), &labels)
            .map_err(nothing("library"))?;
        let cols = references.first().map_or(1, |r| r.at_reference.skin().cols());
        let learned = Learned::new(dictionary, None, library, cols);
        let truths = references.iter().map(|reference| Truth::new(&reference.at_reference, &reference.scored));
        let mut learned =
            Self { decoder: published("matched", &learned)?, truths: truths.collect(), references: Vec::new() };
        let scores = references.iter().enumerate();
        let scores = scores.map(|(label, r)| learned.score(&r.at_reference, &r.scored, label));
        learned.references = scores.collect::<Result<_, Refusal>>()?;
        Ok(learned)
    }

    /// Records and decodes `run`, of the scene with the index `label`; with the time that it took, s.
    fn score(&self, scene: &Scene, run: &ContactRun, label: usize) -> Result<(ChainScores, f64), Refusal> {
        let started = Instant::now();
        let truth = &self.truths[label];
        let of_task = match scene.task() {
            Task::Press(_) => Acquisition::presses,
            Task::Drop(_) => Acquisition::drops,
        };
        let acquisition =
            Acquisition { conditioning_presses: PRESSES_BEFORE, ..of_task(Mode::Compressive, label as u64) };
        let recording = scene.chain().record(&[&run.frames], scene.duration_s(), &acquisition)?;
        let volts = &recording.blocks()[0].volts;
        let rate_hz = recording.sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, reason = "cut to the recording's length")]
        let index = |time_s: f64| (time_s * rate_hz).clamp(0.0, volts.len() as f64) as usize;
        let [start, end] = truth.run.span_s.map(index);
        let first_s = truth.run.frames.iter().find(|f| f.wrench.force_n[2] > 0.0);
        let quiet = index(IDLE * first_s.map_or(scene.duration_s(), |f| f.time_s));
        let untouched = Untouched { offsets_v: wire_means(&recording, 0, 0..quiet), image: None };
        let press = untouched.press(&recording, 0, start..end);
        // at least 20 windows
        let most = (press.len() / 20).max(1);
        let measurements = (scene.skin().taxels() / TAXELS_PER_MEASUREMENT).clamp(1, most);
        let stride = (press.len() / WINDOWS).max(measurements);
        let windows = press.windows(0..press.len(), measurements, stride);
        let (starts, windows): (Vec<usize>, Vec<Window<'_>>) = windows.unzip();
        let mut scorer = Scorer::new(&self.decoder);
        let answers = scorer.answers(&windows)?;
        let mut tally = Tally::default();
        for (window, answer) in starts.iter().zip(&answers) {
            let time_s = (start + window + measurements / 2) as f64 / rate_hz;
            if let Some(expected) = truth.mask(time_s) {
                tally.image(&answer.image, expected);
            }
        }
        let decisions: Vec<Option<usize>> = answers.iter().map(|a| scorer.class(a)).collect();
        tally.decisions(&decisions, label, decisions.len());
        let scores = tally.scores();
        let scores = [scores.support, scores.iou, scores.class_single].map(Option::unwrap_or_default);
        Ok((scores, started.elapsed().as_secs_f64()))
    }
}

impl Truth {
    fn new(scene: &Scene, run: &ContactRun) -> Self {
        let masks = images(scene, run).into_iter().map(|image| {
            let mut mask = Vec::new();
            support(&image, SUPPORT_THRESHOLD, &mut mask);
            mask
        });
        Self { masks: masks.collect(), run: run.clone() }
    }

    fn mask(&self, time_s: f64) -> Option<&[bool]> {
        let index = nearest(&self.run.frames, time_s)?;
        self.masks.get(index).map(Vec::as_slice)
    }
}

/// Conductance of every frame above that of the first, with nothing on the skin, relative to the run's peak.
fn images(scene: &Scene, run: &ContactRun) -> Images {
    let same: Vec<&[spts_contact::Frame]> = vec![&run.frames; PRESSES_BEFORE + 1];
    let maps = scene.chain().conductance_maps(&same, 0).pop().unwrap_or_default();
    let idle = maps.first().map_or_else(Vec::new, |map| map.values().to_vec());
    let above = maps.iter().map(|map| {
        let pairs = map.values().iter().zip(&idle);
        pairs.map(|(g, g0)| (g - g0).max(0.0)).collect::<Vec<f64>>()
    });
    let mut images: Images = above.collect();
    let full = images.iter().map(|image| peak(image)).fold(0.0, f64::max);
    if full > 0.0 {
        images.iter_mut().flatten().for_each(|v| *v /= full);
    }
    images
}

fn peak(image: &[f64]) -> f64 {
    image.iter().copied().fold(0.0, f64::max)
}

// The check of a tolerance: the full chain beside the one that it chose.

/// A contact, the scores after the whole chain, and what it took.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedChain {
    /// Contact model.
    pub contact: String,
    /// Grid squares along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Step of the dynamics, s.
    pub timestep_s: f64,
    /// Support accuracy, against the full chain's truth.
    pub support: f64,
    /// Intersection over union of the support, against the full chain's truth.
    pub iou: f64,
    /// Share of windows that are classified correctly.
    pub class: f64,
    /// Wall time of one press or drop, s.
    pub contact_s: f64,
    /// Wall time of its recording and decoding, s.
    pub readout_s: f64,
}

/// A scene whose contact a tolerance chose, beside the same scene with the full chain.
#[derive(Debug, Clone, Serialize)]
pub struct ToleranceCheck {
    /// What was asked for.
    pub tolerance: Tolerance,
    /// The chain of the scene.
    pub chosen: CheckedChain,
    /// The chain with the finest contact.
    pub full: CheckedChain,
    /// Error of the taxels' pressures over a press, or over the first contact of a drop.
    pub pressure_error: f64,
    /// The difference in what the tolerance is about.
    pub difference: f64,
    /// Whether it is within the tolerance; false where the full chain itself scores less than that, which says nothing.
    pub met: bool,
    /// Times that the full chain took as long.
    pub saves: f64,
}

impl ToleranceCheck {
    /// Runs the scene in the file `scene`, which was saved with a choice, with that and with the full chain. Decoders
    /// learn from its first press or drop with the full chain, and from other objects; the second one is scored.
    ///
    /// # Errors
    /// [`Refusal`] if the scene has no choice, or either chain cannot be run.
    pub fn run(scene: &Path, progress: &dyn Progress) -> Result<Self, Refusal> {
        progress.stage("the full chain beside it", Some(4));
        let own = from_file(scene)?;
        let chosen = Scene::new(own.config.clone(), &own.folder)?;
        let Some(tolerance) = chosen.config().chosen_for_tolerance else {
            return Err(Refusal::new("no tolerance chose the contact of this scene: nothing was left out"));
        };
        let (level, cells_per_taxel) = finest(chosen.mechanics());
        let usual_s: f64 = if own.is_drop() { 1e-4 } else { 5e-4 };
        // on stiff contacts the longest stable step is shorter than the usual one
        let at = |timestep_s: Timestep| {
            let mut config = own.config.clone();
            level.apply(&mut config.contact, cells_per_taxel);
            config.timestep_s = Some(timestep_s);
            Scene::new(config, &own.folder)
        };
        let full = at(Timestep::Seconds(usual_s)).or_else(|_| at(Timestep::Auto))?;
        let run = |scene: &Scene, index| {
            let found = run_contact(scene, index, ONCE);
            progress.step();
            found
        };
        let reference = Reference { learned: run(&full, 0)?, scored: run(&full, 1)?, at_reference: full, scene: own };
        let found = run(&chosen, 1)?;
        let pressure_error = taxel_error(&found, &reference.scored);
        let references = [reference];
        let [reference] = &references;
        let seed = chosen.seed();
        // objects that need no file
        let others = ["T", "tape", "comb"].into_iter().filter(|name| *name != chosen.object()).filter_map(|name| {
            let config = SceneConfig {
                skin: *chosen.skin(),
                ..built_in(name, PUBLISHED_SIDE, seed, Path::new("")).ok()?.config
            };
            let scene = Scene::new(config, Path::new("")).ok()?;
            let run = run_contact(&scene, 0, ONCE).ok()?;
            Some((scene, run))
        });
        let learned = ReferenceScores::learn(&references, &others.collect::<Vec<_>>(), seed)?;
        progress.step();
        let chain = |scene: &Scene, run: &ContactRun| {
            let ([support, iou, class], readout_s) = learned.score(scene, run, 0)?;
            let mechanics = scene.mechanics();
            let contact = mechanics.config().contact.get("model").and_then(toml::Value::as_str).unwrap_or_default();
            Ok::<_, Refusal>(CheckedChain {
                contact: contact.to_owned(),
                cells_per_taxel: mechanics.build_contact()?.cells_per_taxel(),
                timestep_s: mechanics.timestep_s(),
                support,
                iou,
                class,
                contact_s: run.cost_s_per_s * scene.duration_s(),
                readout_s,
            })
        };
        let (chosen, full) = (chain(&chosen, &found)?, chain(&reference.at_reference, &reference.scored)?);
        progress.end();
        let (difference, most, seen) = match tolerance {
            Tolerance::Pressure(most) => (pressure_error, most, 1.0),
            Tolerance::Iou(most) => ((chosen.iou - full.iou).abs(), most, full.iou),
            Tolerance::Class(most) => ((chosen.class - full.class).abs(), most, full.class),
        };
        // a score that is itself below the tolerance cannot differ by more
        let met = difference <= most && seen > most;
        let saves = (full.contact_s + full.readout_s) / (chosen.contact_s + chosen.readout_s);
        Ok(Self { tolerance, chosen, full, pressure_error, difference, met, saves })
    }
}

/// Results of `spts fidelity`: cost and error of every setting of every scene.
#[derive(Debug, Clone, Serialize)]
pub struct FidelityReport {
    /// One row for each scene, level, resolution and time step. The references have zero error.
    pub rows: Vec<MeasuredSetting>,
    /// Settings that could not be run, mostly because of a time step beyond the scene's limit.
    pub refusals: Vec<RefusedSetting>,
    /// Pressure on the contact's grid in the middle of the scored span, one map for each row of `rows`.
    #[serde(skip)]
    pub fine: Vec<FinePressure>,
    /// Provenance of the rows.
    #[serde(skip)]
    pub provenance: Provenance,
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Four dynamic levels and one without, counted by hand; one of them is the reference.
    #[test]
    fn every_level_resolution_and_step() {
        let grid = SettingGrid::full();
        assert_eq!(grid.settings(false).len(), 4 * 5 * 4 + 5 - 1);
        assert_eq!(grid.settings(true).len(), 4 * 5 * 3 - 1);
        assert!(grid.settings(true).iter().all(|s| s.level.dynamic));
    }

    /// 32 · 12 = 384 and 128 · 3 = 384 squares.
    #[test]
    fn larger_skins_have_fewer_squares_a_taxel() {
        assert_eq!(SettingGrid::of(10), SettingGrid::full());
        let of = |side| (SettingGrid::of(side).cells_per_taxel, SettingGrid::of(side).reference_cells);
        assert_eq!((of(32), of(128)), ((vec![2, 3, 6, 12], 12), (vec![2, 3], 3)));
    }

    /// Two cells against four of half the size: the values 1 and 3 against 1, 2, 3, 4 leave errors 0, −1, 0, −1.
    #[test]
    fn coarse_fields_are_compared_on_the_fine_grid() {
        let coarse = FinePressure { rows: 1, cols: 2, pressure_pa: vec![1.0, 3.0] };
        let fine = FinePressure { rows: 1, cols: 4, pressure_pa: vec![1.0, 2.0, 3.0, 4.0] };
        assert_relative_eq!(fine_error(&coarse, &fine), (2.0_f64 / 30.0).sqrt(), max_relative = 1e-15);
        assert!(fine_error(&fine, &fine) <= 0.0);
    }

    /// A study of two scenes on the levels at one coarse and the reference's own resolution.
    fn study(scenes: &[&str]) -> FidelityReport {
        let meshes = tempfile::tempdir().unwrap();
        let study = FidelityStudy {
            scenes: scenes.iter().map(|&s| s.to_owned()).collect(),
            side: PUBLISHED_SIDE,
            grid: SettingGrid {
                cells_per_taxel: vec![2],
                press_steps_s: vec![5e-4],
                drop_steps_s: vec![1e-4],
                reference_cells: 4,
            },
            seed: 1,
        };
        study.run(meshes.path(), &()).unwrap()
    }

    /// The reference has no error; every other level has one, and the layer's own coarser resolution a smaller one than
    /// the half-space, which has no base under it.
    #[test]
    fn errors_are_ordered() {
        let report = study(&["T", "drop"]);
        let row = |scene: &str, level: &str, cells: usize| {
            let found = |r: &&MeasuredSetting| r.scene == scene && r.level == level && r.cells_per_taxel == cells;
            report.rows.iter().find(found).unwrap()
        };
        for scene in ["T", "drop"] {
            let reference = row(scene, "layer", 4);
            assert!(reference.taxel_rms_rel <= 0.0 && reference.pressure_rms_rel <= 0.0, "{reference:?}");
            let (layer, half_space) = (row(scene, "layer", 2), row(scene, "half_space", 2));
            assert!(
                layer.taxel_rms_rel > 0.0 && layer.taxel_rms_rel < half_space.taxel_rms_rel,
                "{layer:?} {half_space:?}"
            );
            assert!(row(scene, "winkler", 2).cost_us_per_step > 0.0);
        }
        assert!(report.rows.iter().all(|r| r.scene != "drop" || r.level != "footprint"));
    }
}
