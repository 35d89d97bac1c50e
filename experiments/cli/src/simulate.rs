//! `spts simulate`: one scene, from its name to its result files.

use crate::context::{Bars, Common, TICK, check_room, note, notes, open_folder, progress, spinner};
use crate::error::CliError;
use crate::options::{number, seed, whole};
use clap::Args;
use indicatif::HumanDuration;
use serde::Serialize;
use spts::Session;
use spts::scene::{Assignment, MESH_COPY, Timestep, Tolerance};
use spts::simulate::{Prepared, Request, Summary, run};
use spts_contact::Frame;
use spts_contact::mesh::MAX_FILE_BYTES;
use spts_contact::objects::{OBJECTS, ObjectSpec, pressable};
use spts_eval::Table;
use spts_eval::decode::{DecodeRequest, DecodedSession, LearnedDecoders};
use spts_eval::decoders::auto;
use spts_eval::training::TrainingData;
use spts_models::{SkinLayout, Streams};
use spts_report::animation::Animation;
use spts_report::simulation::SimulationFiles;
use spts_studies::fidelity::ToleranceCheck;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toml::Value;

/// Simulates one scene and records it through the readout: a robot arm presses an object on the skin, or a ball bounces
/// on it.
///
/// SCENE is `press/NAME` for one of the objects below or `press/finger`, `press` for a mesh of your own, `bounce`,
/// `arm` (a finger touches a skin that is wrapped round a robot's arm and under preload), or a scene file that ends in
/// .toml. The results depend on the scene and the seed alone: the number of threads does not change a byte of them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts simulate --list
  spts simulate press/T
  spts simulate press/tape --presses 10 --force 12 --seed 3 --render
  spts simulate press --mesh cup.obj --scale 0.001 --row 4.5 --col 4.5 --rotation-deg 30
  spts simulate press --mesh scan.stl --as-is --centre
  spts simulate bounce --height 1.0 --presses 5
  spts simulate bounce --animate
  spts simulate arm --set bend.radius_m=0.04 --set bend.strain=0.02
  spts simulate press/T --tolerance 0.05
  spts simulate press/T --tolerance iou=0.02 --check
  spts simulate press/comb --contact layer --cells 12 --timestep auto
  spts simulate press/T --fault dead:44 --fault skipping_clocks:12
  spts simulate press/T --weights firmware
  spts simulate press/T --set press.rise_s=0.5 --set transducer_parameters.temperature_c=35
  spts simulate press/T --set skin.rows=12 --set skin.cols=20 --set skin.pitch_m=0.005
  spts simulate press/rec --set press.position_share=[0.2,0] --set rows.seeds_file=out/seeds/searched_seeds.txt
  spts simulate out/T/scene.toml --out out/again

Files in DIR (N presses, F frames, the skin's rows R and columns C):
  scene.toml                 the scene with every default; simulate it again for the same bytes. Files that it names lie
                             beside it
  manifest.json              what the run wrote, with sizes and SHA-256: a later run replaces these files and no others
  summary.json timing.json   what happened; how long it took on which machine
  frames.csv                 force, torque, pose, peak pressure, area of the loaded taxels, frame by frame
  time_s.npy                 F: time of the frames, s
  pressure_pa.npy            N x F x R x C: mean over each taxel's area, Pa; electrode_pressure_pa.npy over its
                             electrode
  conductance_s.npy          N x F x R x C: what the readout sees, S
  session.json               the recordings as a session, with raster_*.npy and compressive_*.npy: see docs/session.md
  decoded.png decoded.svg    what the taxels conduct, the trace of the wire, images decoded from it at three M
  pressure.png               the pressure at the instant of the largest force; with --render scene.png, scene_close.png
  animation.gif              with --animate: the first press in motion, beside the image decoded from the wire
A drop has frames of its own: time_s_000.npy, pressure_pa_000.npy (F x R x C) and so on.")]
pub(super) struct SimulateCommand {
    #[arg(help = scene_help(), required_unless_present = "list")]
    scene: Option<String>,
    /// List the scenes and the objects, and simulate nothing; with --json as JSON
    #[arg(long, conflicts_with = "scene")]
    list: bool,
    /// Mesh to press with (.obj, .glb or .stl) in place of NAME. The robot arm holds the mesh at the mesh's origin,
    /// with its -z side towards the skin. Small defects are repaired and large meshes are decimated, with a note. A
    /// mesh that cannot be repaired is refused with the reason, unless none of its holes shows from below
    /// [default: none]
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Metres per unit of the mesh file, 0.001 for millimetres; (0, 1000] [default: 1]
    #[arg(long, value_name = "S", requires = "mesh", value_parser = number)]
    scale: Option<f64>,
    /// Press a mesh that is not closed as it is: a shell without thickness, whose holes press nothing
    #[arg(long, requires = "mesh")]
    as_is: bool,
    /// Hold the mesh over the middle of its footprint in place of its origin
    #[arg(long, requires = "mesh")]
    centre: bool,
    /// Row of the object's origin, in taxels; row 0 is the far edge [default: the object's own place]
    #[arg(long, value_name = "ROW", value_parser = number)]
    row: Option<f64>,
    /// Column of the object's origin, in taxels [default: the object's own place]
    #[arg(long, value_name = "COL", value_parser = number)]
    col: Option<f64>,
    /// Rotation about the skin's normal, counter-clockwise from above, degrees; [-360, 360] [default: the object's own]
    #[arg(long, value_name = "DEG", value_parser = number)]
    rotation_deg: Option<f64>,
    /// Tilt about the skin's x and y axes, degrees; each [-60, 60] [default: the object's own]
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    tilt_deg: Option<[f64; 2]>,
    /// Force on the plateau, N; [0.5, 100] [default: 20]
    #[arg(long, value_name = "N", value_parser = number)]
    force: Option<f64>,
    /// Height of a drop, m; [0.001, 5] [default: 0.5]
    #[arg(long, value_name = "M", value_parser = number)]
    height: Option<f64>,
    /// Number of presses or drops [default: 1, or the scene file's]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=100_000))]
    presses: Option<u32>,
    /// Step of the dynamics: seconds, from 1e-6 to the stable limit, or `auto` for the longest stable step that divides
    /// the time between frames, 2 ms at most [default: 5e-4 for a press, 1e-4 for a drop]
    #[arg(long, value_name = "S|auto")]
    timestep: Option<Timestep>,
    /// Contact model, which computes the pressure between object and skin: footprint, winkler, layer or half_space
    /// [default: winkler, or the scene file's]
    #[arg(long, value_name = "NAME")]
    contact: Option<String>,
    /// Resolution of the contact: grid squares along one side of a taxel; [1, 64] [default: 6, or the scene file's]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=64))]
    cells: Option<u32>,
    /// Largest error against the finest contact model and grid: E is the relative error of the taxels' pressures,
    /// [0.03, 1]; iou=E or class=E is the change of that score, [0.005, 0.5]. The twin then chooses the cheapest
    /// contact model and grid with at most this error for this scene, and the longest stable step [default: none;
    /// --contact, --cells and --timestep choose them]
    #[arg(long, value_name = "E", conflicts_with_all = ["contact", "cells", "timestep"])]
    tolerance: Option<Tolerance>,
    /// Also simulate the first two presses or drops with the finest contact model and grid, and print how far the
    /// results with --tolerance differ
    #[arg(long)]
    check: bool,
    /// Root of every random number; [0, 2^63) [default: 0, or the scene file's]
    #[arg(long, value_parser = seed)]
    seed: Option<u64>,
    /// Transducer: velostat or linear [default: velostat, or the scene file's]
    #[arg(long, value_name = "NAME")]
    transducer: Option<String>,
    /// Readout profile: as_built, as_published, as_designed, ideal, or FILE.toml [default: as_built, or the scene
    /// file's]
    #[arg(long, value_name = "NAME|FILE.toml")]
    readout: Option<String>,
    /// Where the weights of the taxels come from. model: the formula of the cells' generator. firmware: the output of
    /// emulated cells (the microcontrollers behind the taxels), which is slower and gives the same recording as long as
    /// the cells keep up with the clock [default: model, or the scene file's]
    #[arg(long, value_name = "NAME")]
    weights: Option<String>,
    /// Faulty cell, repeatable: NAME is one of dead, stuck, mis_seeded, overdriven, skipping_clocks, drifting,
    /// detached; TAXEL counts from 0, row by row. A fault's parameters are set under [[faults]] in a scene or
    /// profile file [default: none]
    #[arg(long = "fault", value_name = "NAME:TAXEL", value_parser = parse_fault)]
    faults: Vec<(String, u32)>,
    /// Sets any key of the scene file, repeatable: KEY is its dotted path, such as press.force_n, skin.rows or
    /// transducer_parameters.temperature_c, VALUE is TOML, and a bare word is a string. docs/scenes.md has all keys.
    /// The options above are short forms for some of them [default: none]
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = str::parse::<Assignment>)]
    set: Vec<Assignment>,
    /// Only the mechanics and the conductance, no recording
    #[arg(long)]
    no_record: bool,
    /// Draw the scene at the instant of the largest force
    #[arg(long)]
    render: bool,
    /// Draw the first press in motion, as a GIF: the pressure on the taxels, the trace of the wire, and the image that
    /// is decoded from that trace in time
    #[arg(long, conflicts_with = "no_record")]
    animate: bool,
    /// Folder for the results. When the run ends, they replace those of an earlier run there; a folder with other files
    /// is refused [default: out/NAME, such as out/T for press/T; with --mesh cup.obj out/cup, or out/cup_2, out/cup_3
    /// and so on where out/cup has the results of another mesh]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// Help of `SCENE`, with the objects that there are.
fn scene_help() -> String {
    let names: Vec<&str> = OBJECTS.iter().map(|object| object.name).collect();
    format!("press/NAME, press (with --mesh), bounce, arm, or FILE.toml; NAME is finger or one of {}", names.join(", "))
}

/// A path as a value of a scene.
fn path(path: &Path) -> Result<Value, CliError> {
    let text = path.to_str().map(Value::from);
    text.ok_or_else(|| CliError::usage(format!("--mesh {}: the name of the file is not valid UTF-8", path.display())))
}

fn parse_pair(text: &str) -> Result<[f64; 2], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y]) => Ok([x, y]),
        _ => Err("two numbers with a comma between them are needed".to_owned()),
    }
}

fn parse_fault(text: &str) -> Result<(String, u32), String> {
    let parts = text.split_once(':');
    let fault = parts.and_then(|(name, taxel)| Some((name.to_owned(), taxel.parse().ok()?)));
    fault.ok_or_else(|| "the name of a fault, a colon and a taxel are needed, such as dead:44".to_owned())
}

impl SimulateCommand {
    /// What the options stand for in the scene: option, keys (of which the one counts whose section the scene has),
    /// value. `--set` comes last, so that it has the last word.
    fn assignments(&self) -> Result<Vec<Assignment>, CliError> {
        const PLACE: [[&str; 2]; 2] = [["press.row", "drop.row"], ["press.col", "drop.col"]];
        let text = |value: &Option<String>| value.clone().map(Value::from);
        let number = |value: Option<f64>| value.map(Value::from);
        let options: [(&str, &[&str], Option<Value>); 19] = [
            ("--mesh", &["press.mesh"], self.mesh.as_deref().map(path).transpose()?),
            ("--scale", &["press.scale"], number(self.scale)),
            ("--as-is", &["press.repair"], self.as_is.then(|| "near_side".into())),
            ("--centre", &["press.centre"], self.centre.then(|| true.into())),
            ("--row", &PLACE[0], number(self.row)),
            ("--col", &PLACE[1], number(self.col)),
            ("--rotation-deg", &["press.rotation_deg"], number(self.rotation_deg)),
            ("--tilt-deg", &["press.tilt_deg"], self.tilt_deg.map(|tilt| tilt.to_vec().into())),
            ("--force", &["press.force_n"], number(self.force)),
            ("--height", &["drop.height_m"], number(self.height)),
            ("--presses", &["press.presses", "drop.drops"], self.presses.map(Value::from)),
            ("--tolerance", &["tolerance"], self.tolerance.map(Tolerance::to_toml)),
            ("--timestep", &["timestep_s"], self.timestep.map(|step| step.to_toml())),
            ("--contact", &["contact.model"], text(&self.contact)),
            ("--cells", &["contact.cells_per_taxel"], self.cells.map(Value::from)),
            ("--seed", &["seed"], self.seed.map(|seed| Value::Integer(seed.cast_signed()))),
            ("--transducer", &["transducer"], text(&self.transducer)),
            ("--readout", &["readout"], text(&self.readout)),
            ("--weights", &["weights"], text(&self.weights)),
        ];
        let mut assignments = Vec::new();
        for (option, keys, value) in options {
            assignments.extend(value.map(|value| Assignment::of_option(option, keys, value)));
        }
        for (name, taxel) in &self.faults {
            let name = ("name".to_owned(), Value::from(name.clone()));
            let fault = toml::Table::from_iter([name, ("taxel".to_owned(), Value::from(*taxel))]);
            assignments.push(Assignment::of_option("--fault", &["faults.+"], fault.into()));
        }
        assignments.extend(self.set.iter().cloned());
        Ok(assignments)
    }

    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        if self.list {
            let list = SceneList::new();
            return self.common.print(&list, || list.text());
        }
        self.common.start()?;
        let request = Request { scene: self.scene.clone().unwrap_or_default(), assignments: self.assignments()? };
        let prepared = request.prepare()?;
        if self.check && prepared.scene.config().chosen_for_tolerance.is_none() {
            return Err(CliError::usage("--check needs a scene with a tolerance, as with --tolerance 0.05"));
        }
        let out = self.out.clone();
        let out = out.unwrap_or_else(|| default_folder(&prepared));
        let presses = prepared.scene.repeats();
        let folder = open_folder(&out)?;
        check_room(&out, &format!("a run of {presses} presses or drops"), prepared.bytes(!self.no_record))?;
        let mut files = SimulationFiles::create(folder, &prepared, !self.no_record)?;
        let bar = progress(presses, "simulating");
        let done = || {
            bar.inc(1);
            if Some(bar.position()) == bar.length() {
                // emulated cells take seconds for a recording
                bar.set_message("recording");
                bar.enable_steady_tick(TICK);
            }
        };
        let mut first: Vec<Frame> = Vec::new();
        let started = Instant::now();
        let simulate = || {
            run(&prepared, !self.no_record, &done, |piece| {
                if self.animate && piece.first == 0 {
                    first.extend(piece.presses.iter().take(1).flat_map(|press| press.frames.clone()));
                }
                files.push(&piece)?;
                let left = time_left(started.elapsed(), piece.first + piece.presses.len(), piece.of);
                left.iter().filter(|_| piece.first == 0).for_each(|left| bar.suspend(|| note(left)));
                Ok(())
            })
        };
        let layout = prepared.scene.skin();
        let decodes = !self.no_record && layout.taxels() <= MOST_DECODED;
        // what a decoder learns depends on the skin alone, and the mechanics of one press leave a core to it
        let (simulation, learned) = rayon::join(simulate, || decodes.then(|| Learned::new(layout)).transpose());
        bar.finish_and_clear();
        let (simulation, learned) = (simulation?, learned?);
        let summary = Summary::new(&prepared, &simulation);
        notes(&summary.notes);
        let writing = spinner("writing");
        if !self.no_record && !decodes {
            note(&format!(
                "note: a skin of more than {MOST_DECODED} taxels is not decoded here; `spts decode` does it"
            ));
        }
        if let Some(scan) = simulation.first.as_ref().and_then(long_scan) {
            note(&scan);
        }
        let decoded = match simulation.first.as_ref().zip(learned.as_ref()) {
            Some((session, learned)) => learned.decoded(session)?,
            None => None,
        };
        if let Some(session) = simulation.first.as_ref().filter(|_| self.animate) {
            let training = learned.as_ref().map(|learned| &learned.training);
            files.animate(&Animation::new(&prepared, &first, session, training)?)?;
        }
        let names = files.finish(&simulation, &summary, self.render, decoded)?;
        drop(writing);
        let check = self.check.then(|| ToleranceCheck::run(&out.join("scene.toml"), &Bars::default())).transpose()?;
        let checked = check.as_ref().map(spts_report::fidelity::check_text).unwrap_or_default();
        let text = || format!("{}\n{}: {}{checked}", summary.table(), out.display(), names.join(", "));
        self.common.print(&Printed { summary: &summary, check: check.as_ref() }, text)
    }
}

/// A run of which more than this is left says so.
const LONG: Duration = Duration::from_secs(60);

/// A note on the time that is left of a long run, of which `done` of `all` presses took `elapsed`.
fn time_left(elapsed: Duration, done: usize, all: usize) -> Option<String> {
    let left_s = elapsed.as_secs_f64() * all.saturating_sub(done) as f64 / done.max(1) as f64;
    let left = Duration::try_from_secs_f64(left_s).unwrap_or(Duration::MAX);
    (left > LONG).then(|| {
        format!("note: {done} of {all} presses or drops are done; the others take about {}", HumanDuration(left))
    })
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<&'a ToleranceCheck>,
}

/// What is to be said of a session in which a scan of all taxels takes longer than the object is held.
fn long_scan(session: &Session) -> Option<String> {
    let raster = session.raster()?;
    let scan_s = raster.measurements_per_frame() as f64 / raster.sample_rate_hz();
    let held_s = session.hold_s.map(|[start_s, end_s]| end_s - start_s)?;
    (scan_s > held_s).then(|| {
        format!(
            "note: a scan of {} taxels takes {scan_s:.2} s, and the hold lasts {held_s:.2} s: no scan shows it alone; press.lift_s \
             and press.duration_s make it longer",
            raster.taxels()
        )
    })
}

/// What decodes a session as `spts decode` does unless told otherwise.
struct Learned {
    training: TrainingData,
    request: DecodeRequest,
    decoders: LearnedDecoders,
}

impl Learned {
    fn new(layout: &SkinLayout) -> Result<Self, CliError> {
        let training = TrainingData::for_layout(layout, Streams::new(1))?;
        let request = DecodeRequest {
            decoders: vec![auto([layout.rows(), layout.cols()], false)],
            measurements: DecodeRequest::default_measurements(layout.taxels()),
            windows: 1,
            network: None,
            seed: 1,
        };
        Ok(Self { decoders: request.learn(layout, &training, None)?, training, request })
    }

    /// The decoded session; `None` without a compressive recording.
    fn decoded(&self, session: &Session) -> Result<Option<DecodedSession>, CliError> {
        let decode = || self.request.decode(session, &self.decoders);
        Ok(session.compressive().map(|_| decode()).transpose()?)
    }
}

/// Most taxels of a skin that `spts simulate` decodes at its end: a second or two.
const MOST_DECODED: usize = 1100;

/// Everything that `SCENE` may be, as it stands on the command line, and what it is.
const SCENES: [(&str, &str); 5] = [
    ("press/NAME", "A robot arm presses the object NAME, one of those below, on the skin"),
    ("press --mesh FILE", "The arm presses a mesh of your own: .obj, .glb or .stl"),
    ("bounce", "A tennis ball falls on the skin and bounces"),
    ("arm", "A finger touches a skin that is wrapped round a robot's arm"),
    ("FILE.toml", "A scene file. Every run writes one, scene.toml, to start from"),
];

/// What `--list` prints.
#[derive(Serialize)]
struct SceneList {
    scenes: Table<'static, (&'static str, &'static str)>,
    objects: Table<'static, &'static ObjectSpec>,
}

impl SceneList {
    fn new() -> Self {
        let scenes = Table::new("scenes", SCENES).column("scene", "scene", |(scene, _)| scene);
        let objects = Table::new("objects", pressable()).column("name", "object for press/NAME", |object| object.name);
        Self {
            scenes: scenes.column("about", "what it is", |(_, about)| about),
            objects: objects
                .file("label", |object| object.label)
                .column("about", "what it is", |object| object.description),
        }
    }

    fn text(&self) -> String {
        format!("{}\n{}\nTry: spts simulate press/T", self.scenes.text(), self.objects.text())
    }
}

/// Folder of all runs that name none.
const OUT: &str = "out";

/// `out/NAME`, where NAME is that of the scene: of the object, or of the file of a mesh. Where the results of another
/// mesh, or of anything else, lie there, a mesh gets the first of `out/NAME_2`, `out/NAME_3`, … in which they do not.
fn default_folder(prepared: &Prepared) -> PathBuf {
    let named = |name: &str| Path::new(OUT).join(name);
    let name = prepared.scene.name();
    let is_mesh = |(file, _): &&(String, Vec<u8>)| Path::new(file).file_stem() == Some(MESH_COPY.as_ref());
    let Some((file, bytes)) = prepared.copies.iter().find(is_mesh) else {
        return named(name);
    };
    // the same mesh, whatever its force and place: a run that replaces the one before
    let same = |folder: &Path| spts_input::read(&folder.join(file), MAX_FILE_BYTES).is_ok_and(|there| there == *bytes);
    let others = (2_u32..).map(|number| named(&format!("{name}_{number}")));
    let mut folders = [named(name)].into_iter().chain(others);
    let free = folders.find(|folder| !folder.exists() || same(folder));
    free.unwrap_or_else(|| named(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts::simulate::NAMED_SCENES;

    #[test]
    fn long_runs_say_what_is_left() {
        let of = |seconds: u64, done: usize, all: usize| time_left(Duration::from_secs(seconds), done, all);
        assert_eq!(of(2, 4, 100), None);
        assert_eq!(of(600, 4, 4), None);
        let said = "note: 4 of 100 presses or drops are done; the others take about 4 minutes";
        assert_eq!(of(10, 4, 100).as_deref(), Some(said));
    }

    /// Every scene that ships is listed, and what is listed can be simulated.
    #[test]
    fn the_list_is_complete() {
        for (name, _) in NAMED_SCENES {
            assert!(SCENES.iter().any(|(scene, _)| scene == name), "{name}");
        }
        let plain = SCENES.iter().map(|(scene, _)| (*scene).to_owned());
        let plain = plain.filter(|scene| !scene.contains(|c: char| c.is_uppercase()));
        let objects = pressable().map(|object| format!("press/{}", object.name));
        for scene in plain.chain(objects) {
            let request = Request { scene, ..Request::default() };
            request.prepare().unwrap();
        }
    }
}
