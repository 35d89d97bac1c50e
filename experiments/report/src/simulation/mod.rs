//! Files and pictures of `spts simulate`.

mod frames;
mod picture;

use super::ReportError;
use super::animation::{ANIMATION_FILE, Animation};
use super::decode::save_picture;
use super::figures::encode_png;
use frames::{FRAME_COLUMNS, MapFiles, frame_row};
use picture::{pressure_picture, scene_pictures};
use serde::Serialize;
use spts::Mode;
use spts::output::{CsvFile, OutputError, OutputFolder, write_bytes, write_json};
use spts::provenance::Machine;
use spts::session::{SESSION_FILE, SessionWriter};
use spts::simulate::{Prepared, SimulatedPiece, Simulation, Summary};
use spts_eval::decode::DecodedSession;
use spts_input::Refusal;
use std::path::PathBuf;

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
        source: Refusal,
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

/// Files of every run.
pub const FILES: &[&str] = &[
    "scene.toml",
    "summary.json",
    "timing.json",
    "frames.csv",
    "pressure.png",
    "scene.png",
    "scene_close.png",
    "decoded.png",
    "decoded.svg",
    ANIMATION_FILE,
    SESSION_FILE,
];

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
    /// [`ReportError`] when a file cannot be written.
    pub fn create(out: OutputFolder, prepared: &'a Prepared, record: bool) -> Result<Self, ReportError> {
        let begin = || {
            write_bytes(&out.path("scene.toml"), prepared.scene_toml.as_bytes())?;
            for (name, content) in &prepared.copies {
                write_bytes(&out.path(name), content)?;
            }
            let session = record.then(|| SessionWriter::create(&out.path(""), &prepared.session()));
            Ok((
                CsvFile::create(&out.path("frames.csv"), FRAME_COLUMNS)?,
                session.transpose()?,
            ))
        };
        let (frames, session) = begin().map_err(|error| out.unstaged(error))?;
        Ok(Self {
            maps: MapFiles::new(prepared),
            frames,
            session,
            out,
            prepared,
        })
    }

    /// Writes the next presses.
    ///
    /// # Errors
    /// [`ReportError`] when a file cannot be written.
    pub fn push(&mut self, piece: &SimulatedPiece<'_>) -> Result<(), ReportError> {
        Ok(self.write(piece).map_err(|error| self.out.unstaged(error))?)
    }

    fn write(&mut self, piece: &SimulatedPiece<'_>) -> Result<(), OutputError> {
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
    /// [`ReportError`] when the file cannot be written or no font is found.
    pub fn animate(&self, animation: &Animation) -> Result<(), ReportError> {
        let path = self.out.path(ANIMATION_FILE);
        let gif = animation.gif(&path).map_err(ReportError::from);
        let written = gif.and_then(|gif| Ok(write_bytes(&path, &gif)?));
        written.map_err(|error| error.unstaged(&self.out))
    }

    /// Writes what is known at the end, with a picture of the `decoded` first blocks, and puts all files in place. With
    /// `render`, pictures of the scene as well; when those cannot be drawn, the rest is put in place first. Returns the
    /// names of the files.
    ///
    /// # Errors
    /// [`SimulationWriteError`] when a file cannot be written or the scene cannot be drawn.
    pub fn finish(
        self,
        simulation: &Simulation,
        summary: &Summary,
        render: bool,
        decoded: Option<DecodedSession>,
    ) -> Result<Vec<String>, SimulationWriteError> {
        let Self {
            mut out,
            prepared,
            frames,
            maps,
            session,
        } = self;
        let numbers = || {
            frames.finish()?;
            maps.finish()?;
            session.map(SessionWriter::finish).transpose()?;
            write_json(&out.path("summary.json"), summary)?;
            write_json(&out.timed_path("timing.json"), &SimulationTiming::of(simulation))
        };
        let written = numbers().map_err(ReportError::from);
        let pictures = || -> Result<(), ReportError> {
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
        written
            .and_then(|()| pictures())
            .map_err(|error| error.unstaged(&out))?;
        let drawn = render.then(|| scene_pictures(prepared, simulation)).transpose();
        for (name, picture) in drawn.iter().flatten().flatten() {
            let path = out.path(name);
            let png = encode_png(&picture.rgb, picture.width, picture.height, &path).map_err(ReportError::from);
            let written = png.and_then(|png| Ok(write_bytes(&path, &png)?));
            written.map_err(|error| error.unstaged(&out))?;
        }
        let folder = out.shown().to_owned();
        let names = out.commit().map_err(ReportError::from)?;
        match drawn {
            Ok(_) => Ok(names),
            Err(source) => Err(SimulationWriteError::Scene { source, folder }),
        }
    }
}
