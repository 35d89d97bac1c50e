//! The published recordings of the real skin, in this project's layout or that of the original repository.

use super::converter::published_converter;
use super::error::DataError;
use super::mat::{MatVariable, read_mat};
use super::recording_files::{RecordingFiles, recording_files};
use super::set::{Published, SessionSet, published_place};
use crate::session::{Event, Recorded, Session};
use spts_circuit::{Block, Mode, Recording, RecordingInfo, Seeding, WeightMode, Weights};
use spts_contact::objects::OBJECTS;
use spts_models::SkinLayout;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::path::{Path, PathBuf};

/// Rate of the published recordings, Hz: from the beat of the cells' timer interrupt against the measurement clock.
const RATE_HZ: f64 = 64_300.0;
/// Taxels of the published skin, which is also the number of measurements in a frame.
const TAXELS: usize = TAXEL_COUNT as usize;
const TAXEL_COUNT: u32 = 100;
/// Library columns of one class; the first ten columns are the empty class 0.
const LIBRARY_COLUMNS_PER_CLASS: usize = 10;
/// Frames at the start of every press in which nothing touches the skin.
const IDLE_FRAMES: usize = 150;
/// Frames of a press in which the published evaluation takes the contact as steady.
const HOLD_FRAMES: [f64; 2] = [500.0, 700.0];
/// Presses at the start of a session that only condition the skin.
const CONDITIONING: usize = 5;

/// A directory that holds at least one published recording.
#[derive(Debug, Clone)]
pub(super) struct PublishedFiles {
    /// The folder that was opened.
    root: PathBuf,
    /// The folder to which the names below are relative.
    base: PathBuf,
}

impl PublishedFiles {
    /// Folders of the presses, of the drops and of the robot's arm, in this project's layout and the repository's.
    const PRESSES: [&str; 2] = ["presses", "Measurements_Collected"];
    const DROPS: [&str; 2] = ["bounces", "Application_Data/ball_bouncing"];
    const ARM: [&str; 2] = ["robot_arm", "Application_Data/robort_arm"];

    /// Opens the directory `root`, which may be the root of a clone of the published repository.
    ///
    /// # Errors
    /// [`DataError::NothingFound`] when it holds no recording in a known layout.
    pub(super) fn open(root: &Path) -> Result<Self, DataError> {
        let known = [Self::PRESSES, Self::DROPS, Self::ARM].concat();
        let holds = |base: &PathBuf| known.iter().any(|folder| base.join(folder).is_dir());
        let base = [root.to_owned(), root.join("Data_Analysis")].into_iter().find(holds);
        match base {
            Some(base) => Ok(Self {
                root: root.to_owned(),
                base,
            }),
            None => Err(DataError::NothingFound { path: root.to_owned() }),
        }
    }

    /// Dictionary and library beside the sessions in the folder `root`, where both are there.
    ///
    /// # Errors
    /// [`DataError`] when a file is there but cannot be used.
    pub(super) fn beside(root: &Path) -> Result<Option<Published>, DataError> {
        let (root, base) = (root.to_owned(), root.to_owned());
        Self { root, base }.published()
    }

    /// Reads all sessions, and dictionary and library where they are there.
    ///
    /// # Errors
    /// [`DataError`] when a file is there but cannot be used, or no session is there at all.
    pub(super) fn read(&self) -> Result<SessionSet, DataError> {
        let mut sessions = self.presses()?;
        let mut missing = Vec::new();
        if !sessions.is_empty() {
            for object in OBJECTS {
                let of_object = |s: &&Session| s.object == object.name;
                match sessions.iter().find(of_object).map(|s| (&s.raster, &s.compressive)) {
                    None | Some((None, _)) => missing.push(format!("{}: raster session", object.name)),
                    Some((_, None)) => missing.push(format!("{}: compressive session", object.name)),
                    Some(_) => {}
                }
            }
        }
        let drops = self.folder_of(&Self::DROPS);
        let drops = drops.map_or(Ok(Vec::new()), |folder| self.events(&folder, Event::Drop))?;
        if drops.iter().all(|s| s.compressive.is_none()) {
            missing.push("bouncing ball: compressive session".to_owned());
        }
        sessions.extend(drops);
        if let Some(folder) = self.folder_of(&Self::ARM) {
            sessions.extend(self.events(&folder, Event::Touch)?);
        }
        if sessions.is_empty() {
            return Err(DataError::NothingFound {
                path: self.root.clone(),
            });
        }
        Ok(SessionSet {
            root: self.root.clone(),
            sessions,
            published: self.published()?,
            missing,
        })
    }

    fn folder_of(&self, names: &[&str]) -> Option<PathBuf> {
        names.iter().map(|name| self.base.join(name)).find(|path| path.is_dir())
    }

    /// Sessions of the presses, one an object and repetition.
    fn presses(&self) -> Result<Vec<Session>, DataError> {
        let Some(folder) = self.folder_of(&Self::PRESSES) else {
            return Ok(Vec::new());
        };
        let mut objects = folders(&folder)?;
        objects.sort_by(|a, b| published_place(a).cmp(&published_place(b)).then_with(|| a.cmp(b)));
        let mut sessions = Vec::new();
        for object in &objects {
            let found = recording_files(&folder.join(object), &format!("{object}_"))?;
            let first_raster = found.first().and_then(|files| files.raster.clone());
            for files in &found {
                // repeated sums are of the same contact as the first scan
                let raster = files.raster.as_ref().or(first_raster.as_ref());
                if raster.is_some() || files.compressive.is_some() {
                    sessions.push(press(object, files, raster)?);
                }
            }
        }
        Ok(sessions)
    }

    /// Sessions of events whose blocks follow each other without a gap, so that block k ends at frame (k + 1) · frames:
    /// a fit of the ball's contact with these rows leaves .34–.49 of the signal, with any others .93 or more.
    fn events(&self, folder: &Path, event: Event) -> Result<Vec<Session>, DataError> {
        let mut sessions = Vec::new();
        for files in recording_files(folder, "")? {
            let (name, object) = match event {
                Event::Drop => files.ball(),
                Event::Press | Event::Touch => (format!("robot_arm{}", files.suffix), "finger".to_owned()),
            };
            let read = |path: &PathBuf, mode| {
                let blocks = blocks(path, mode)?.into_iter().enumerate();
                let positioned = blocks.map(|(k, volts)| ((k as u64 + 1) * (volts.len() / TAXELS) as u64, volts));
                recording(path, mode, None, positioned).map(Recorded::new)
            };
            sessions.push(Session {
                object,
                raster: files.raster.as_ref().map(|path| read(path, Mode::Raster)).transpose()?,
                compressive: files
                    .compressive
                    .as_ref()
                    .map(|path| read(path, Mode::Compressive))
                    .transpose()?,
                ..Session::new(&name, event)
            });
        }
        Ok(sessions)
    }

    /// Published dictionary and library, or `None` when one of the two files is missing.
    fn published(&self) -> Result<Option<Published>, DataError> {
        let file = |name: &str| {
            let folders = ["", "Dictionary_Learning/", "SRC_Library/"];
            let paths = folders.map(|folder| self.base.join(format!("{folder}{name}.mat")));
            paths.into_iter().find(|path| path.exists())
        };
        let (Some(dictionary), Some(library)) = (file("dictionary"), file("SRC_lib")) else {
            return Ok(None);
        };
        let images = matrix(&library, "lib_new")?;
        let labels: Vec<usize> = (0..images.ncols()).map(|k| k / LIBRARY_COLUMNS_PER_CLASS).collect();
        Ok(Some(Published {
            dictionary: matrix(&dictionary, "Dksvd")?,
            shifted: file("permuted_dictionary")
                .map(|path| matrix(&path, "Dksvd_new"))
                .transpose()?,
            library: Library::new(&images, &labels).map_err(|e| DataError::NotMat {
                path: library,
                reason: e.to_string(),
            })?,
        }))
    }
}

/// Names of the folders in `folder`.
fn folders(folder: &Path) -> Result<Vec<String>, DataError> {
    let io = |source| DataError::Io {
        path: folder.to_owned(),
        source,
    };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    Ok(names)
}

/// One recording of the presses of `object`.
fn press(object: &str, files: &RecordingFiles, raster: Option<&PathBuf>) -> Result<Session, DataError> {
    let scans = |path: &PathBuf| {
        let blocks = blocks(path, Mode::Raster)?.into_iter();
        let positioned = blocks.map(|volts| ((volts.len() / TAXELS) as u64, volts));
        recording(path, Mode::Raster, Some(IDLE_FRAMES), positioned)
    };
    let scans = raster.map(scans).transpose()?;
    let sums = files.compressive.as_ref().map(|path| sums(path, files)).transpose()?;
    let name = format!("{object}{}", files.suffix);
    Ok(Session {
        object: object.to_owned(),
        hold_s: Some(HOLD_FRAMES.map(|frame| frame * TAXELS as f64 / RATE_HZ)),
        raster: scans.map(conditioned),
        compressive: sums.map(conditioned),
        ..Session::new(&name, Event::Press)
    })
}

/// A recording whose first presses only condition the skin.
fn conditioned(recording: Recording) -> Recorded {
    Recorded {
        conditioning: CONDITIONING,
        ..Recorded::new(recording)
    }
}

/// The compressive recording at `path`, with the positions of its blocks.
fn sums(path: &Path, files: &RecordingFiles) -> Result<Recording, DataError> {
    let Some(time_path) = &files.positions else {
        return Err(DataError::Missing {
            path: path.with_file_name(
                path.file_stem()
                    .map_or_else(String::new, |stem| format!("{}_time.mat", stem.to_string_lossy())),
            ),
            needed_by: path.display().to_string(),
        });
    };
    let blocks = blocks(path, Mode::Compressive)?;
    let positions = read_mat(time_path, "framePosition")?;
    if positions.values.len() != blocks.len() {
        return Err(DataError::Shape {
            path: time_path.clone(),
            name: "framePosition",
            shape: positions.shape,
            expected: "one position a press",
        });
    }
    let mut positioned = Vec::with_capacity(blocks.len());
    for (index, (&value, volts)) in positions.values.iter().zip(blocks).enumerate() {
        positioned.push((frame_position(time_path, index, value)?, volts));
    }
    recording(path, Mode::Compressive, Some(IDLE_FRAMES), positioned)
}

/// The blocks in the file at `path`: raster scans are called `D` or `C`, sums `C`.
fn blocks(path: &Path, mode: Mode) -> Result<Vec<Vec<f64>>, DataError> {
    if mode == Mode::Raster {
        match read_mat(path, "D") {
            Ok(array) => return split_blocks(path, "D", &array),
            Err(error @ DataError::NoVariable { .. }) => {
                let array = match read_mat(path, "C") {
                    Err(DataError::NoVariable { .. }) => return Err(error),
                    array => array?,
                };
                return split_blocks(path, "C", &array);
            }
            Err(error) => return Err(error),
        }
    }
    split_blocks(path, "C", &read_mat(path, "C")?)
}

fn recording(
    path: &Path,
    mode: Mode,
    idle_frames: Option<usize>,
    blocks: impl IntoIterator<Item = (u64, Vec<f64>)>,
) -> Result<Recording, DataError> {
    let blocks = blocks.into_iter().map(|(frame_position, volts)| Block {
        frame_position,
        idle_frames: idle_frames.map(|idle| idle.min(volts.len() / TAXELS)),
        volts,
    });
    let blocks: Vec<Block> = blocks.collect();
    let info = RecordingInfo {
        converter: published_converter(mode, &blocks),
        ..RecordingInfo::new(SkinLayout::default(), weights(mode), RATE_HZ)
    };
    let recording = Recording::new(info, blocks);
    recording.map_err(|source| DataError::Recording {
        path: path.to_owned(),
        source,
    })
}

/// Cuts a `100 × frames × presses` array into presses; MATLAB's order is the recording's order.
fn split_blocks(path: &Path, name: &'static str, array: &MatVariable) -> Result<Vec<Vec<f64>>, DataError> {
    let frames = match array.shape[..] {
        [TAXELS, frames] | [TAXELS, frames, _] if frames > 0 && !array.values.is_empty() => frames,
        _ => {
            return Err(DataError::Shape {
                path: path.to_owned(),
                name,
                shape: array.shape.clone(),
                expected: "100 × frames × presses",
            });
        }
    };
    Ok(array
        .values
        .chunks_exact(TAXELS * frames)
        .map(<[f64]>::to_vec)
        .collect())
}

#[expect(clippy::cast_possible_truncation, reason = "checked to be a whole number in range")]
fn frame_position(path: &Path, index: usize, value: f64) -> Result<u64, DataError> {
    /// Frames of about two years of recording.
    const MAX: f64 = 4e10;
    if value.fract() == 0.0 && (0.0..=MAX).contains(&value) {
        return Ok(value as u64);
    }
    Err(DataError::Value {
        path: path.to_owned(),
        name: "framePosition",
        index,
        value,
        range: "the whole numbers in [0, 4e10]",
    })
}

/// A matrix with one row a taxel.
fn matrix(path: &Path, name: &'static str) -> Result<Matrix, DataError> {
    let array = read_mat(path, name)?;
    let [TAXELS, columns] = array.shape[..] else {
        return Err(DataError::Shape {
            path: path.to_owned(),
            name,
            shape: array.shape,
            expected: "100 × columns",
        });
    };
    if let Some(index) = array.values.iter().position(|v| !v.is_finite()) {
        return Err(DataError::Value {
            path: path.to_owned(),
            name,
            index,
            value: array.values[index],
            range: "the finite numbers",
        });
    }
    Matrix::from_columns(TAXELS, columns, &array.values).map_err(|e| DataError::NotMat {
        path: path.to_owned(),
        reason: e.to_string(),
    })
}

/// Weights of the published device: cells seeded with their addresses.
fn weights(mode: Mode) -> Weights {
    let mode = match mode {
        Mode::Raster => WeightMode::Raster,
        Mode::Compressive => WeightMode::Binary,
    };
    Weights::new(mode, Seeding::Address, TAXEL_COUNT)
}
