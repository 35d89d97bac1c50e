//! Files and pictures of `spts simulate`.

mod picture;

use super::ReportError;
use super::decode::save_picture;
use picture::{pressure_picture, scene_pictures};
use serde::Serialize;
use spts::output::{OutputError, OutputFolder, Staged, write_bytes, write_csv, write_json, write_npy};
use spts::provenance::Machine;
use spts::scene::{SEEDS_COPY, Task};
use spts::session::SESSION_FILE;
use spts::simulate::{Prepared, Simulation, Summary};
use spts_contact::Frame;
use spts_eval::decode::DecodedSession;
use spts_models::{ConductanceMap, SkinLayout};
use spts_sim::SimError;
use std::path::{Path, PathBuf};

/// Results of a simulation that were not written, or not all of them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationWriteError {
    /// A file cannot be written, or the pressure map cannot be drawn: there are no new results.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The scene cannot be drawn; everything else was written.
    #[error("{source}; everything else was written to {}", folder.display())]
    Scene {
        /// Cause.
        source: SimError,
        /// Where the rest is.
        folder: PathBuf,
    },
}

/// How long a run took, and on what: a file of its own, so that all others compare byte for byte.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationTiming {
    /// The machine.
    pub machine: Machine,
    /// Time of the mechanics, s.
    pub mechanics_s: f64,
    /// Time of transducer and readout, s.
    pub recording_s: f64,
}

impl SimulationTiming {
    /// Timing of `simulation` on this machine.
    #[must_use]
    pub fn of(simulation: &Simulation) -> Self {
        Self {
            machine: Machine::here(),
            mechanics_s: simulation.mechanics.as_secs_f64(),
            recording_s: simulation.recording.as_secs_f64(),
        }
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

/// Writes every result of a run into the folder `out`, all of them or none, with a picture of the `decoded` session.
/// With `render`, pictures of the scene as well; when those cannot be drawn, the rest is written first. Returns the
/// names of the files.
///
/// # Errors
/// [`SimulationWriteError`] when a file cannot be written or the scene cannot be drawn.
pub fn write(
    prepared: &Prepared,
    simulation: &Simulation,
    summary: &Summary,
    render: bool,
    decoded: Option<DecodedSession>,
    out: &Path,
) -> Result<Vec<String>, SimulationWriteError> {
    let stage = || OutputFolder::create(out)?.stage();
    let staged = stage().map_err(ReportError::from)?;
    let written = write_numbers(&staged, prepared, simulation, summary).map_err(ReportError::from);
    written
        .and_then(|()| pressure_picture(&staged, prepared, simulation))
        .and_then(|()| match simulation.session.as_ref().zip(decoded) {
            Some(pair) => Ok(save_picture(&[pair], &staged.path(""), "decoded")?),
            None => Ok(()),
        })
        .map_err(|error| error.unstaged(&staged))?;
    let drawn = if render {
        scene_pictures(&staged, prepared, simulation)
    } else {
        Ok(())
    };
    let names = staged.commit_replacing(&is_result).map_err(ReportError::from)?;
    match drawn {
        Ok(()) => Ok(names),
        Err(source) => Err(SimulationWriteError::Scene {
            source,
            folder: out.to_owned(),
        }),
    }
}

/// Whether `name` is the name of a picture or an array that some run writes: what an earlier run has left would else
/// stand beside this run's results.
fn is_result(name: &str) -> bool {
    if [
        "scene.png",
        "scene_close.png",
        "decoded.png",
        "decoded.svg",
        SESSION_FILE,
        SEEDS_COPY,
    ]
    .contains(&name)
    {
        return true;
    }
    let Some(stem) = name.strip_suffix(".npy") else {
        return false;
    };
    // arrays of drops are numbered
    let stem = stem.rsplit_once('_').map_or(stem, |(rest, last)| {
        if last.bytes().all(|b| b.is_ascii_digit()) {
            rest
        } else {
            stem
        }
    });
    [
        "time_s",
        "pressure_pa",
        "electrode_pressure_pa",
        "conductance_s",
        "raster_codes",
        "raster_volts",
        "raster_pressure_pa",
        "raster_conductance_s",
        "compressive_codes",
        "compressive_volts",
        "compressive_pressure_pa",
        "compressive_conductance_s",
    ]
    .contains(&stem)
}

fn write_numbers(
    staged: &Staged,
    prepared: &Prepared,
    simulation: &Simulation,
    summary: &Summary,
) -> Result<(), OutputError> {
    let skin = prepared.scene.skin();
    write_bytes(&staged.path("scene.toml"), prepared.scene_toml.as_bytes())?;
    for (name, content) in &prepared.copies {
        write_bytes(&staged.path(name), content)?;
    }
    write_json(&staged.path("summary.json"), summary)?;
    write_json(&staged.path("timing.json"), &SimulationTiming::of(simulation))?;
    let numbered = simulation.presses.iter().enumerate();
    let rows = numbered.flat_map(|(press, p)| p.frames.iter().map(move |frame| frame_row(press, frame, skin)));
    write_csv(&staged.path("frames.csv"), FRAME_COLUMNS, rows)?;
    write_maps(staged, prepared, simulation)?;
    match &simulation.session {
        Some(session) => session.write_files(&staged.path("")),
        None => Ok(()),
    }
}

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

/// Times and maps: of all presses together, which are sampled alike, or drop by drop, which are not.
fn write_maps(staged: &Staged, prepared: &Prepared, simulation: &Simulation) -> Result<(), OutputError> {
    let skin = prepared.scene.skin();
    let (rows, cols) = (skin.rows(), skin.cols());
    let together = matches!(prepared.scene.task(), Task::Press(_));
    let count = simulation.presses.len();
    let groups: Vec<_> = if together {
        vec![(0..count, String::new())]
    } else {
        (0..count).map(|i| (i..i + 1, format!("_{i:03}"))).collect()
    };
    for (group, suffix) in groups {
        let presses = &simulation.presses[group.clone()];
        let frames = presses.first().map_or(0, |p| p.frames.len());
        let times_s: Vec<f64> = presses
            .iter()
            .take(1)
            .flat_map(|p| &p.frames)
            .map(|f| f.time_s)
            .collect();
        write_npy(&staged.path(&format!("time_s{suffix}.npy")), &[frames], &times_s)?;
        let shape = [presses.len(), frames, rows, cols];
        let shape = if together { &shape[..] } else { &shape[1..] };
        let of_frames = |values: fn(&Frame) -> &[f64]| -> Vec<f64> {
            let all = presses.iter().flat_map(|p| &p.frames);
            all.flat_map(values).copied().collect()
        };
        let conductance: Vec<f64> = simulation.conductance[group]
            .iter()
            .flatten()
            .flat_map(ConductanceMap::values)
            .copied()
            .collect();
        for (name, values) in [
            ("pressure_pa", of_frames(|f| f.pressure.values())),
            ("electrode_pressure_pa", of_frames(|f| f.electrode_pressure.values())),
            ("conductance_s", conductance),
        ] {
            write_npy(&staged.path(&format!("{name}{suffix}.npy")), shape, &values)?;
        }
    }
    Ok(())
}
