//! Files and pictures of `spts simulate`.

use super::animation::{ANIMATION_FILE, Animation};
use super::decode::save_picture;
use super::figures::encode_png;
use crate::figures::pressure_png;
use serde::Serialize;
use spts::Mode;
use spts::output::{CsvFile, NpyFile, OutputFolder, unwritable, write_bytes, write_json, write_npy};
use spts::provenance::Machine;
use spts::scene::Task;
use spts::session::SessionWriter;
use spts::simulate::{Prepared, SimulatedPiece, Simulation, Summary};
use spts_contact::Frame;
use spts_eval::decode::DecodedSession;
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout};
use spts_sim::World;
use spts_sim::render::{Camera, Picture, Renderer};

/// The results of a run, which are written while it goes on. All of them appear at its end, or none.
pub struct SimulationFiles<'a> {
    out: OutputFolder,
    prepared: &'a Prepared,
    frames: CsvFile,
    maps: MapFiles,
    session: Option<SessionWriter>,
}

impl<'a> SimulationFiles<'a> {
    /// Begins the results of `prepared` in the folder `out`, with a session if its presses are recorded.
    ///
    /// # Errors
    /// [`Refusal`] when a file cannot be written.
    pub fn create(out: OutputFolder, prepared: &'a Prepared, record: bool) -> Result<Self, Refusal> {
        let begin = || {
            write_bytes(&out.path("scene.toml"), prepared.scene_toml.as_bytes())?;
            for (name, content) in &prepared.copies {
                write_bytes(&out.path(name), content)?;
            }
            let session = record.then(|| SessionWriter::create(&out.path(""), &prepared.session()));
            Ok((CsvFile::create(&out.path("frames.csv"), FRAME_COLUMNS)?, session.transpose()?))
        };
        let (frames, session) = begin().map_err(|error| out.unstaged(error))?;
        Ok(Self { maps: MapFiles::new(prepared), frames, session, out, prepared })
    }

    /// Writes the next presses.
    ///
    /// # Errors
    /// [`Refusal`] when a file cannot be written.
    pub fn push(&mut self, piece: &SimulatedPiece<'_>) -> Result<(), Refusal> {
        self.write(piece).map_err(|error| self.out.unstaged(error))
    }

    fn write(&mut self, piece: &SimulatedPiece<'_>) -> Result<(), Refusal> {
        let skin = self.prepared.scene.skin();
        for (press, frames) in (piece.first..).zip(piece.presses) {
            for frame in &frames.frames {
                self.frames.push(frame_row(press, frame, skin))?;
            }
        }
        self.maps.push(&self.out, piece)?;
        if let Some(session) = &mut self.session {
            for (mode, recorded) in [(Mode::Raster, &piece.raster), (Mode::Compressive, &piece.compressive)] {
                if let Some(recorded) = recorded {
                    session.push(mode, recorded, piece.of)?;
                }
            }
        }
        Ok(())
    }

    /// Writes the `animation` of a press.
    ///
    /// # Errors
    /// [`Refusal`] when the file cannot be written.
    pub fn animate(&self, animation: &Animation) -> Result<(), Refusal> {
        let path = self.out.path(ANIMATION_FILE);
        let gif = animation.gif(&path);
        let written = gif.and_then(|gif| write_bytes(&path, &gif));
        written.map_err(|error| self.out.unstaged(error))
    }

    /// Writes what is known at the end, with a picture of the `decoded` first blocks, and puts all files in place. With
    /// `render`, pictures of the scene as well; when those cannot be drawn, the rest is put in place first. How long
    /// the run took has a file of its own, so that all others compare byte for byte. Returns the names of the files.
    ///
    /// # Errors
    /// [`Refusal`] when a file cannot be written or the scene cannot be drawn.
    pub fn finish(
        self,
        simulation: &Simulation,
        summary: &Summary,
        render: bool,
        decoded: Option<DecodedSession>,
    ) -> Result<Vec<String>, Refusal> {
        #[derive(Serialize)]
        struct SimulationTiming {
            machine: Machine,
            mechanics_s: f64,
            recording_s: f64,
        }
        let Self { mut out, prepared, frames, maps, session } = self;
        let numbers = || {
            frames.finish()?;
            maps.finish()?;
            session.map(SessionWriter::finish).transpose()?;
            write_json(&out.path("summary.json"), summary)?;
            let timing = SimulationTiming {
                machine: Machine::here(),
                mechanics_s: simulation.mechanics.as_secs_f64(),
                recording_s: simulation.recording.as_secs_f64(),
            };
            write_json(&out.timed_path("timing.json"), &timing)
        };
        let written = numbers();
        let pictures = || -> Result<(), Refusal> {
            let folder = out.path("");
            let pair = simulation.first.as_ref().zip(decoded);
            let (pressure, decoded) = rayon::join(
                || pressure_picture(&out, prepared, simulation),
                || pair.map(|pair| save_picture(&[pair], &folder, "decoded")).transpose(),
            );
            pressure?;
            decoded?;
            Ok(())
        };
        written.and_then(|()| pictures()).map_err(|error| out.unstaged(error))?;
        let drawn = render.then(|| scene_pictures(prepared, simulation)).transpose();
        for (name, picture) in drawn.iter().flatten().flatten() {
            let path = out.path(name);
            let png = encode_png(&picture.rgb, picture.width, picture.height).map_err(unwritable(&path));
            let written = png.and_then(|png| write_bytes(&path, &png));
            written.map_err(|error| out.unstaged(error))?;
        }
        let folder = out.shown().to_owned();
        let names = out.commit()?;
        drawn
            .map(|_| names)
            .map_err(|source| Refusal::new(format!("{source}; everything else was written to {}", folder.display())))
    }
}

/// Columns of `frames.csv`.
const FRAME_COLUMNS: &[&str] = &[
    "press",
    "time_s",
    "force_x_n",
    "force_y_n",
    "force_z_n",
    "torque_x_nm",
    "torque_y_nm",
    "torque_z_nm",
    "position_x_m",
    "position_y_m",
    "position_z_m",
    "quaternion_w",
    "quaternion_x",
    "quaternion_y",
    "quaternion_z",
    "peak_pressure_pa",
    "contact_area_m2",
];

/// One row of `frames.csv`. The contact area is that of all taxel cells with any pressure on them.
fn frame_row(press: usize, frame: &Frame, skin: &SkinLayout) -> impl Serialize + use<> {
    let loaded = frame.pressure.values().iter().filter(|p| **p > 0.0).count() as f64;
    (
        (press, frame.time_s, frame.wrench.force_n, frame.wrench.torque_nm),
        (frame.pose.position_m, frame.pose.quaternion),
        frame.pressure.max(),
        loaded * skin.cell_area_m2(),
    )
}

/// Pressure, electrode pressure and conductance.
type Maps = [NpyFile<f64>; 3];

/// Times and maps: of all presses together, which are sampled alike, or drop by drop, which are not.
struct MapFiles {
    together: bool,
    taxels: [usize; 2],
    maps: Option<Maps>,
}

impl MapFiles {
    fn new(prepared: &Prepared) -> Self {
        let skin = prepared.scene.skin();
        Self {
            together: matches!(prepared.scene.task(), Task::Press(_)),
            taxels: [skin.rows(), skin.cols()],
            maps: None,
        }
    }

    fn push(&mut self, out: &OutputFolder, piece: &SimulatedPiece<'_>) -> Result<(), Refusal> {
        let [rows, cols] = self.taxels;
        for (k, press) in piece.presses.iter().enumerate() {
            let frames = &press.frames;
            let conductance = piece.conductance[k].maps();
            let times_s = || frames.iter().map(|f| f.time_s).collect::<Vec<_>>();
            if self.together {
                let maps = match &mut self.maps {
                    Some(maps) => maps,
                    None => {
                        write_npy(&out.path("time_s.npy"), &[frames.len()], &times_s())?;
                        self.maps.insert(create_maps(out, "", &[piece.of, frames.len(), rows, cols])?)
                    }
                };
                push_maps(maps, frames, conductance)?;
            } else {
                let suffix = format!("_{:03}", piece.first + k);
                write_npy(&out.path(&format!("time_s{suffix}.npy")), &[frames.len()], &times_s())?;
                let mut maps = create_maps(out, &suffix, &[frames.len(), rows, cols])?;
                push_maps(&mut maps, frames, conductance)?;
                maps.into_iter().try_for_each(NpyFile::finish)?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<(), Refusal> {
        self.maps.into_iter().flatten().try_for_each(NpyFile::finish)
    }
}

fn create_maps(out: &OutputFolder, suffix: &str, shape: &[usize]) -> Result<Maps, Refusal> {
    let file = |name: &str| NpyFile::create(&out.path(&format!("{name}{suffix}.npy")), shape);
    Ok([file("pressure_pa")?, file("electrode_pressure_pa")?, file("conductance_s")?])
}

fn push_maps(maps: &mut Maps, frames: &[Frame], conductance: &[ConductanceMap]) -> Result<(), Refusal> {
    let [pressure, electrode, conductances] = maps;
    for frame in frames {
        pressure.push(frame.pressure.values().iter().copied())?;
        electrode.push(frame.electrode_pressure.values().iter().copied())?;
    }
    let maps = conductance.iter();
    maps.into_iter().try_for_each(|map| conductances.push(map.values().iter().copied()))
}

/// Size of the pictures of the scene, pixels.
const SCENE_PIXELS: [usize; 2] = [1280, 960];
const KPA_PER_PA: f64 = 1e-3;

/// `pressure.png`: the pressure map.
fn pressure_picture(out: &OutputFolder, prepared: &Prepared, simulation: &Simulation) -> Result<(), Refusal> {
    let Some(frame) = simulation.peak.as_ref().map(|peak| &peak.at) else {
        return Ok(());
    };
    let map = &frame.pressure;
    let title = format!("{}: pressure at {:.1} N, {:.3} s", prepared.body(), frame.wrench.force_n[2], frame.time_s);
    let path = out.path("pressure.png");
    pressure_png(map.values(), map.rows(), map.cols(), "kPa", KPA_PER_PA, &title, &path)
}

/// `scene.png` and `scene_close.png`: the scene from afar and close up, the skin coloured by its pressure.
fn scene_pictures(prepared: &Prepared, simulation: &Simulation) -> Result<Vec<(&'static str, Picture)>, Refusal> {
    let Some(peak) = &simulation.peak else {
        return Ok(Vec::new());
    };
    // the same press again, up to that frame
    let mut world = World::repeat(prepared.scene.mechanics(), peak.press)?;
    let frame = world.frames().nth(peak.frame).transpose()?;
    let full_pa = frame.as_ref().map_or(0.0, |f| f.pressure.max()).max(f64::MIN_POSITIVE);
    let [width, height] = SCENE_PIXELS;
    let mut renderer = Renderer::new(&world, width, height)?;
    let cameras = [("scene.png", Camera::Wide), ("scene_close.png", Camera::Close)];
    let pictures = cameras.map(|(name, camera)| {
        let picture = renderer.draw(&world, camera, frame.as_ref().map(|f| (f, full_pa)));
        Ok((name, picture?))
    });
    pictures.into_iter().collect()
}
