//! Frames as a table and as arrays, written while the presses come.

use serde::Serialize;
use spts::output::{NpyFile, OutputError, OutputFolder, write_npy};
use spts::scene::Task;
use spts::simulate::{Prepared, SimulatedPiece};
use spts_contact::Frame;
use spts_models::{ConductanceMap, SkinLayout};

/// Columns of `frames.csv`.
pub(super) const FRAME_COLUMNS: &[&str] = &[
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
pub(super) fn frame_row(press: usize, frame: &Frame, skin: &SkinLayout) -> impl Serialize + use<> {
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
pub(super) struct MapFiles {
    together: bool,
    taxels: [usize; 2],
    maps: Option<Maps>,
}

impl MapFiles {
    pub(super) fn new(prepared: &Prepared) -> Self {
        let skin = prepared.scene.skin();
        Self {
            together: matches!(prepared.scene.task(), Task::Press(_)),
            taxels: [skin.rows(), skin.cols()],
            maps: None,
        }
    }

    pub(super) fn push(&mut self, out: &OutputFolder, piece: &SimulatedPiece<'_>) -> Result<(), OutputError> {
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
                        self.maps
                            .insert(create(out, "", &[piece.of, frames.len(), rows, cols])?)
                    }
                };
                push(maps, frames, conductance)?;
            } else {
                let suffix = format!("_{:03}", piece.first + k);
                write_npy(&out.path(&format!("time_s{suffix}.npy")), &[frames.len()], &times_s())?;
                let mut maps = create(out, &suffix, &[frames.len(), rows, cols])?;
                push(&mut maps, frames, conductance)?;
                maps.into_iter().try_for_each(NpyFile::finish)?;
            }
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), OutputError> {
        self.maps.into_iter().flatten().try_for_each(NpyFile::finish)
    }
}

fn create(out: &OutputFolder, suffix: &str, shape: &[usize]) -> Result<Maps, OutputError> {
    let file = |name: &str| NpyFile::create(&out.path(&format!("{name}{suffix}.npy")), shape);
    Ok([
        file("pressure_pa")?,
        file("electrode_pressure_pa")?,
        file("conductance_s")?,
    ])
}

fn push(maps: &mut Maps, frames: &[Frame], conductance: &[ConductanceMap]) -> Result<(), OutputError> {
    let [pressure, electrode, conductances] = maps;
    for frame in frames {
        pressure.push(frame.pressure.values().iter().copied())?;
        electrode.push(frame.electrode_pressure.values().iter().copied())?;
    }
    let maps = conductance.iter();
    maps.into_iter()
        .try_for_each(|map| conductances.push(map.values().iter().copied()))
}
