//! The twin's recordings as `spts reproduce --save-recordings` leaves them.

use super::directory::{IDLE_FRAMES, frame_position, published_info};
use super::error::DataError;
use super::npy::read_npy;
use crate::output::{OutputError, write_npy};
use crate::score::Session;
use spts_circuit::{Block, Mode, Recording};
use spts_sim::objects::OBJECTS;
use std::path::{Path, PathBuf};

/// End of the name of a raster session's array, as of the published files.
const RASTER: &str = "raster";
/// End of the name of a compressive session's array.
const COMPRESSIVE: &str = "random2";

/// Reads the twin's sessions in label order from `dir`: a report's folder, or its folder `arrays`. An object's raster session is
/// `NAME_raster.npy`, its compressive one `NAME_random2.npy`, each of shape (presses, frames, measurements) in volts, with one frame
/// position a press in `…_frame_position.npy`. Objects without a raster session are left out.
///
/// # Errors
/// [`DataError`] when no object is there at all, or an array that is there cannot be used or lacks its frame positions.
pub fn load_twin(dir: &Path) -> Result<Vec<Session>, DataError> {
    let folder = folder(dir);
    std::fs::read_dir(&folder).map_err(|source| DataError::Io {
        path: folder.clone(),
        source,
    })?;
    let mut sessions = Vec::new();
    for object in OBJECTS {
        let read = |suffix, mode| session(&folder, object.name, suffix, mode);
        let Some(raster) = read(RASTER, Mode::Raster)? else {
            continue;
        };
        sessions.push(Session {
            object: object.name.to_owned(),
            label: usize::from(object.label),
            raster,
            compressive: read(COMPRESSIVE, Mode::Compressive)?,
        });
    }
    if sessions.is_empty() {
        return Err(DataError::NoTwin { path: folder });
    }
    Ok(sessions)
}

/// Reads the session of the bouncing ball from `dir`, as [`load_twin`] does the others; `None` when there is none.
///
/// # Errors
/// [`DataError`] when an array that is there cannot be used or lacks its frame positions.
pub fn load_twin_bounces(dir: &Path) -> Result<Option<Recording>, DataError> {
    session(&folder(dir), "tennis_bounces", "random2", Mode::Compressive)
}

/// The arrays of a report's folder, or the folder itself.
fn folder(dir: &Path) -> PathBuf {
    let arrays = dir.join("arrays");
    if arrays.is_dir() { arrays } else { dir.to_owned() }
}

/// Writes `recording` into `folder` as [`load_twin`] reads it: `NAME.npy` in volts, and `NAME_frame_position.npy`.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn save_recording(folder: &Path, name: &str, recording: &Recording) -> Result<(), OutputError> {
    let blocks = recording.blocks();
    let volts: Vec<f64> = blocks.iter().flat_map(|b| b.volts.iter().copied()).collect();
    let shape = [blocks.len(), recording.frames(), recording.measurements_per_frame()];
    write_npy(&folder.join(format!("{name}.npy")), &shape, &volts)?;
    let positions: Vec<f64> = blocks.iter().map(|b| b.frame_position as f64).collect();
    let name = format!("{name}_frame_position.npy");
    write_npy(&folder.join(name), &[positions.len()], &positions)
}

/// Writes `sessions` into `folder` as [`load_twin`] reads them.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn save_twin<'a>(folder: &Path, sessions: impl IntoIterator<Item = &'a Session>) -> Result<(), OutputError> {
    for session in sessions {
        save_recording(folder, &format!("{}_{RASTER}", session.object), &session.raster)?;
        if let Some(compressive) = &session.compressive {
            save_recording(folder, &format!("{}_{COMPRESSIVE}", session.object), compressive)?;
        }
    }
    Ok(())
}

/// One session of an object, or `None` when it is not there.
fn session(folder: &Path, object: &str, suffix: &str, mode: Mode) -> Result<Option<Recording>, DataError> {
    let path = folder.join(format!("{object}_{suffix}.npy"));
    if !path.is_file() {
        return Ok(None);
    }
    let array = read_npy(&path)?;
    let [presses, frames, measurements] = array.shape[..] else {
        return Err(shape(path, "volts", array.shape, "presses × frames × measurements"));
    };
    let positions = positions(
        &path,
        &folder.join(format!("{object}_{suffix}_frame_position.npy")),
        presses,
    )?;
    let volts = array.values.chunks_exact((frames * measurements).max(1));
    let blocks = volts.zip(positions).map(|(volts, frame_position)| Block {
        frame_position,
        idle_frames: Some(IDLE_FRAMES.min(frames)),
        volts: volts.to_vec(),
    });
    // a report is recorded with the default readout, which has the published rate and as many measurements a frame as taxels
    let recording = published_info(mode, measurements).and_then(|info| Recording::new(info, blocks.collect()));
    recording
        .map(Some)
        .map_err(|source| DataError::Recording { path, source })
}

/// Frame positions of the `presses` of the session at `volts`.
fn positions(volts: &Path, path: &Path, presses: usize) -> Result<Vec<u64>, DataError> {
    if !path.is_file() {
        return Err(DataError::Missing {
            path: path.to_owned(),
            needed_by: volts.display().to_string(),
        });
    }
    let array = read_npy(path)?;
    if array.shape != [presses] {
        return Err(shape(
            path.to_owned(),
            "framePosition",
            array.shape,
            "one position a press",
        ));
    }
    let values = array.values.iter().enumerate();
    values
        .map(|(index, &value)| frame_position(path, index, value))
        .collect()
}

fn shape(path: PathBuf, name: &'static str, shape: Vec<usize>, expected: &'static str) -> DataError {
    DataError::Shape {
        path,
        name,
        shape,
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::directory::PUBLISHED_RATE_HZ;
    use crate::twin::DEFAULT_READOUT;
    use spts_circuit::Profile;

    /// A session of two presses of three frames of four taxels.
    fn write(folder: &Path, name: &str) -> Vec<f64> {
        let volts: Vec<f64> = (0..24).map(|i| 0.25 * f64::from(i)).collect();
        write_npy(&folder.join(format!("{name}.npy")), &[2, 3, 4], &volts).unwrap();
        write_npy(&folder.join(format!("{name}_frame_position.npy")), &[2], &[3.0, 10.0]).unwrap();
        volts
    }

    #[test]
    fn sessions_come_back_in_label_order() {
        let dir = tempfile::tempdir().unwrap();
        let arrays = dir.path().join("arrays");
        std::fs::create_dir(&arrays).unwrap();
        let (last, first) = (&OBJECTS[OBJECTS.len() - 1], &OBJECTS[0]);
        let volts = write(&arrays, &format!("{}_raster", last.name));
        write(&arrays, &format!("{}_raster", first.name));
        write(&arrays, &format!("{}_random2", first.name));
        for place in [dir.path(), &arrays] {
            let sessions = load_twin(place).unwrap();
            let copy = tempfile::tempdir().unwrap();
            save_twin(copy.path(), &sessions).unwrap();
            for (a, b) in sessions.iter().zip(load_twin(copy.path()).unwrap()) {
                assert_eq!((&a.raster, &a.compressive), (&b.raster, &b.compressive));
            }
            let names: Vec<&str> = sessions.iter().map(|s| s.object.as_str()).collect();
            assert_eq!(names, [first.name, last.name]);
            assert!(sessions[0].compressive.is_some() && sessions[1].compressive.is_none());
            let raster = &sessions[1].raster;
            assert_eq!((raster.mode(), raster.frames(), raster.taxels()), (Mode::Raster, 3, 4));
            assert_eq!(raster.volts(1, 2), &volts[20..]);
            assert_eq!(raster.first_row(1, 0), 28);
        }
    }

    #[test]
    fn the_default_readout_has_the_published_rate() {
        let profile = Profile::named(DEFAULT_READOUT).unwrap();
        assert_eq!(profile.sample_rate_hz.to_bits(), PUBLISHED_RATE_HZ.to_bits());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let said = || load_twin(dir.path()).unwrap_err().to_string();
        assert!(said().contains("no simulated recordings"), "{}", said());
        write(dir.path(), "brain_raster");
        let positions = dir.path().join("brain_raster_frame_position.npy");
        for (values, expected) in [
            (vec![3.0], "one position a press"),
            (vec![3.0, 2.5], "`framePosition`[1] = 2.5"),
            (vec![3.0, 2.0], "ends at frame 2"),
        ] {
            write_npy(&positions, &[values.len()], &values).unwrap();
            assert!(
                said().contains(expected) && said().contains("brain_raster"),
                "{}",
                said()
            );
        }
        std::fs::remove_file(&positions).unwrap();
        assert!(
            said().contains("brain_raster_frame_position.npy: missing"),
            "{}",
            said()
        );
        write(dir.path(), "brain_raster");
        let volts = dir.path().join("brain_raster.npy");
        write_npy(&volts, &[2, 12], &[0.0; 24]).unwrap();
        assert!(said().contains("presses × frames × measurements"), "{}", said());
        write_npy(&volts, &[2, 0, 4], &[]).unwrap();
        assert!(said().contains("brain_raster.npy"), "{}", said());
    }
}
