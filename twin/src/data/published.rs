//! The published recordings of the real skin, in this project's layout or that of the original repository.

use super::mat::{MatVariable, not_mat, read_mat};
use crate::session::{Event, Recorded, Session};
use spts_circuit::{
    Block, CodeScale, Converter, ConverterConfig, Mode, Recording, RecordingInfo, Seeding, WeightMode, Weights,
};
use spts_contact::objects::OBJECTS;
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The sessions of a folder, dictionary and library where they are there, and the recordings that are missing.
pub(super) type Found = (Vec<Session>, Option<Published>, Vec<String>);

/// Says of which recordings the order of taxels and frames cannot be told by their shapes.
pub(super) fn square(sessions: &[Session]) -> Option<String> {
    let is_square = |r: &Option<Recorded>| {
        r.as_ref().is_some_and(|r| r.recording.blocks().iter().any(|b| b.volts.len() == TAXELS * TAXELS))
    };
    let found = sessions.iter().filter(|s| is_square(&s.raster) || is_square(&s.compressive));
    let names: Vec<&str> = found.map(|s| s.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: arrays of {TAXELS} × {TAXELS} × presses are read as taxels × frames × presses; with frames first, they \
             would look the same and the images be wrong",
            names.join(", ")
        )
    })
}

/// The refusal of the folder `root`, which has no recordings.
pub fn nothing_found(root: &Path) -> Refusal {
    let expected = "session.json, folders with one, or the published recordings (presses/NAME/NAME_raster.mat, \
                    Measurements_Collected/NAME/NAME_raster.mat, or a clone of their repository)";
    Refusal::new(format!("no recordings found; expected {expected}")).at(root.display())
}

/// The refusal of the file at `path`, which is not there, and which `needed_by` needs.
pub fn missing_file(path: &Path, needed_by: &str) -> Refusal {
    Refusal::new(format!("missing; {needed_by} needs it")).at(path.display())
}

/// Dictionary, shifted dictionary and classifier library, as published.
#[derive(Debug, Clone)]
pub struct Published {
    /// K-SVD dictionary, 100 × 100.
    pub dictionary: Matrix,
    /// Shifted copies of the dictionary, 100 × 2450; `None` if the file is missing.
    pub shifted: Option<Matrix>,
    /// Labelled raster images. The label of an object is its place among the published objects, from 1.
    pub library: Library,
}

/// Place of an object among the published ones; all others come after them.
pub(super) fn published_place(object: &str) -> usize {
    let place = spts_contact::objects::OBJECTS.iter().position(|o| o.name == object);
    place.unwrap_or(usize::MAX)
}

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
    /// [`Refusal`] when it holds no recording in a known layout.
    pub(super) fn open(root: &Path) -> Result<Self, Refusal> {
        let known = [Self::PRESSES, Self::DROPS, Self::ARM].concat();
        let holds = |base: &PathBuf| known.iter().any(|folder| base.join(folder).is_dir());
        let base = [root.to_owned(), root.join("Data_Analysis")].into_iter().find(holds);
        match base {
            Some(base) => Ok(Self { root: root.to_owned(), base }),
            None => Err(nothing_found(root)),
        }
    }

    /// Dictionary and library beside the sessions in the folder `root`, where both are there.
    ///
    /// # Errors
    /// [`Refusal`] when a file is there but cannot be used.
    pub(super) fn beside(root: &Path) -> Result<Option<Published>, Refusal> {
        let (root, base) = (root.to_owned(), root.to_owned());
        Self { root, base }.published()
    }

    /// Reads all sessions, and dictionary and library where they are there, and names the recordings that are not.
    ///
    /// # Errors
    /// [`Refusal`] when a file is there but cannot be used, or no session is there at all.
    pub(super) fn read(&self) -> Result<Found, Refusal> {
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
            return Err(nothing_found(&self.root));
        }
        Ok((sessions, self.published()?, missing))
    }

    fn folder_of(&self, names: &[&str]) -> Option<PathBuf> {
        names.iter().map(|name| self.base.join(name)).find(|path| path.is_dir())
    }

    /// Sessions of the presses, one an object and repetition.
    fn presses(&self) -> Result<Vec<Session>, Refusal> {
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
    fn events(&self, folder: &Path, event: Event) -> Result<Vec<Session>, Refusal> {
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
                compressive: files.compressive.as_ref().map(|path| read(path, Mode::Compressive)).transpose()?,
                ..Session::new(&name, event)
            });
        }
        Ok(sessions)
    }

    /// Published dictionary and library, or `None` when one of the two files is missing.
    fn published(&self) -> Result<Option<Published>, Refusal> {
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
            shifted: file("permuted_dictionary").map(|path| matrix(&path, "Dksvd_new")).transpose()?,
            library: Library::new(&images, &labels).map_err(|e| not_mat(&library, &e.to_string()))?,
        }))
    }
}

/// Names of the folders in `folder`.
fn folders(folder: &Path) -> Result<Vec<String>, Refusal> {
    let io = Refusal::in_file(folder);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&io)? {
        let entry = entry.map_err(&io)?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    Ok(names)
}

/// One recording of the presses of `object`.
fn press(object: &str, files: &RecordingFiles, raster: Option<&PathBuf>) -> Result<Session, Refusal> {
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
    Recorded { conditioning: CONDITIONING, ..Recorded::new(recording) }
}

/// The compressive recording at `path`, with the positions of its blocks.
fn sums(path: &Path, files: &RecordingFiles) -> Result<Recording, Refusal> {
    let Some(time_path) = &files.positions else {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let positions = path.with_file_name(format!("{stem}_time.mat"));
        return Err(missing_file(&positions, &path.display().to_string()));
    };
    let blocks = blocks(path, Mode::Compressive)?;
    let positions = read_mat(time_path, &["framePosition"])?;
    if positions.values.len() != blocks.len() {
        return Err(wrong_shape(time_path, &positions, "one position a press"));
    }
    let mut positioned = Vec::with_capacity(blocks.len());
    for (index, (&value, volts)) in positions.values.iter().zip(blocks).enumerate() {
        positioned.push((frame_position(time_path, index, value)?, volts));
    }
    recording(path, Mode::Compressive, Some(IDLE_FRAMES), positioned)
}

/// The blocks in the file at `path`: raster scans are called `D` or `C`, sums `C`.
fn blocks(path: &Path, mode: Mode) -> Result<Vec<Vec<f64>>, Refusal> {
    let names: &[&str] = if mode == Mode::Raster { &["D", "C"] } else { &["C"] };
    let array = read_mat(path, names)?;
    // MATLAB's order, 100 × frames × presses, is the recording's order
    let frames = match array.shape[..] {
        [TAXELS, frames] | [TAXELS, frames, _] if frames > 0 && !array.values.is_empty() => frames,
        _ => return Err(wrong_shape(path, &array, "100 × frames × presses")),
    };
    Ok(array.values.chunks_exact(TAXELS * frames).map(<[f64]>::to_vec).collect())
}

/// The error of a variable of the wrong shape.
fn wrong_shape(path: &Path, array: &MatVariable, expected: &str) -> Refusal {
    let MatVariable { name, shape, .. } = array;
    Refusal::new(format!("`{name}` has shape {shape:?}; expected {expected}")).at(path.display())
}

/// The error of a value outside its range.
fn wrong_value(path: &Path, name: &str, index: usize, value: f64, range: &str) -> Refusal {
    Refusal::new(format!("`{name}`[{index}] = {value} is outside {range}")).at(path.display())
}

fn recording(
    path: &Path,
    mode: Mode,
    idle_frames: Option<usize>,
    blocks: impl IntoIterator<Item = (u64, Vec<f64>)>,
) -> Result<Recording, Refusal> {
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
    recording.map_err(|error| error.at(path.display()))
}

#[expect(clippy::cast_possible_truncation, reason = "checked to be a whole number in range")]
fn frame_position(path: &Path, index: usize, value: f64) -> Result<u64, Refusal> {
    /// Frames of about two years of recording.
    const MAX: f64 = 4e10;
    if value.fract() == 0.0 && (0.0..=MAX).contains(&value) {
        return Ok(value as u64);
    }
    Err(wrong_value(path, "framePosition", index, value, "the whole numbers in [0, 4e10]"))
}

/// A matrix with one row a taxel.
fn matrix(path: &Path, name: &'static str) -> Result<Matrix, Refusal> {
    let array = read_mat(path, &[name])?;
    let [TAXELS, columns] = array.shape[..] else {
        return Err(wrong_shape(path, &array, "100 × columns"));
    };
    if let Some(index) = array.values.iter().position(|v| !v.is_finite()) {
        return Err(wrong_value(path, name, index, array.values[index], "the finite numbers"));
    }
    Matrix::from_columns(TAXELS, columns, &array.values).map_err(|e| not_mat(path, &e.to_string()))
}

/// Weights of the published device: cells seeded with their addresses.
fn weights(mode: Mode) -> Weights {
    let mode = match mode {
        Mode::Raster => WeightMode::Raster,
        Mode::Compressive => WeightMode::Binary,
    };
    Weights::new(mode, Seeding::Address, TAXEL_COUNT)
}

/// Files of one recording. A recording that was repeated has files of its own for every repetition.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct RecordingFiles {
    /// What follows the name: nothing for the first recording, `_re`, `_retake`, `_film` for its repetitions.
    suffix: String,
    /// Raster scans.
    raster: Option<PathBuf>,
    /// Sums.
    compressive: Option<PathBuf>,
    /// Positions of the blocks of the sums.
    positions: Option<PathBuf>,
}

impl RecordingFiles {
    /// Name and object of a recording of the bouncing ball, whose files are called `random2_tennis_re` and the like.
    fn ball(&self) -> (String, String) {
        let words: Vec<&str> = self.suffix.split('_').filter(|word| !word.is_empty()).collect();
        let (ball, rest) = match words.split_first() {
            Some((&ball, rest)) if ball == "tennis" || ball == "ball" => (ball, rest),
            _ => ("ball", words.as_slice()),
        };
        let name = [&[ball, "bounces"], rest].concat().join("_");
        (name, ball.to_owned())
    }
}

/// Recordings in `folder` whose files are called `{prefix}raster…`, `{prefix}random2…` and `{prefix}random2…_time`,
/// repetitions after the first one.
///
/// # Errors
/// [`Refusal`] when the folder cannot be read.
fn recording_files(folder: &Path, prefix: &str) -> Result<Vec<RecordingFiles>, Refusal> {
    let io = Refusal::in_file(folder);
    let mut found: BTreeMap<String, RecordingFiles> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(&io)? {
        let path = entry.map_err(&io)?.path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Some(name) = stem.strip_prefix(prefix).filter(|_| path.extension().is_some_and(|e| e == "mat")) else {
            continue;
        };
        // 0: scans, 1: sums, 2: positions
        let (suffix, kind) = match (name.strip_prefix("raster"), name.strip_prefix("random2")) {
            (Some(suffix), _) => (suffix, 0),
            (_, Some(suffix)) => suffix.strip_suffix("_time").map_or((suffix, 1), |suffix| (suffix, 2)),
            _ => continue,
        };
        // `random2_` is the first recording of a ball without a name, whose scans are called `raster_ball`
        let suffix = if suffix == "_" { "_ball" } else { suffix };
        let suffix = if suffix.is_empty() || suffix.starts_with('_') {
            suffix
        } else {
            continue;
        };
        let files = found.entry(suffix.to_owned()).or_default();
        suffix.clone_into(&mut files.suffix);
        *[&mut files.raster, &mut files.compressive, &mut files.positions][kind] = Some(path);
    }
    let found = found.into_values();
    Ok(found.filter(|files| files.raster.is_some() || files.compressive.is_some()).collect())
}

/// Largest constant that the publication subtracted from a raster scan before it set negative volts to 0, hundredths of
/// a volt; all are whole hundredths, of either sign.
const MOST_SUBTRACTED: i32 = 20;

/// Scale that made the volts of `blocks`, every one of them bit for bit; `None` when it is not the published one. From
/// a raster scan a constant was subtracted that differs between sessions, and negative volts were set to 0.
pub(super) fn published_converter(mode: Mode, blocks: &[Block]) -> Option<Converter> {
    let (offset_v, numerator, denominator) = match mode {
        Mode::Raster => (4.3, 508.0, 165.0),
        Mode::Compressive => (32.0, 11_140.0, 570.0),
    };
    let constants = (0..=MOST_SUBTRACTED).flat_map(|k| [k, -k]).map(|k| Some(f64::from(k) / 100.0));
    let constants: Vec<Option<f64>> = match mode {
        Mode::Raster => std::iter::once(None).chain(constants).collect(),
        Mode::Compressive => vec![None],
    };
    let converters = constants.into_iter().filter_map(|subtract_v| {
        let scale = CodeScale::Divider { reference_v: 3.3, numerator, denominator };
        Converter::new(ConverterConfig { offset_v, scale, max_code: 1023, subtract_v }).ok()
    });
    converters.into_iter().find(|c| blocks.iter().all(|block| c.made(&block.volts)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names in the published repository.
    #[test]
    fn repetitions_of_the_ball_have_names_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["random2_", "random2_re", "random2_tennis", "random2_tennis_re", "raster_ball", "raster_tennis"] {
            std::fs::write(dir.path().join(format!("{name}.mat")), "").unwrap();
        }
        std::fs::write(dir.path().join("random2_tennis.fig"), "").unwrap();
        let found = recording_files(dir.path(), "").unwrap();
        let names: Vec<(String, String, bool)> = found
            .iter()
            .map(|files| {
                let (name, object) = files.ball();
                (name, object, files.raster.is_some())
            })
            .collect();
        let expected = [
            ("ball_bounces", "ball", true),
            ("ball_bounces_re", "ball", false),
            ("tennis_bounces", "tennis", true),
            ("tennis_bounces_re", "tennis", false),
        ];
        assert_eq!(names, expected.map(|(name, object, raster)| (name.to_owned(), object.to_owned(), raster)));
    }

    #[test]
    fn repetitions_of_a_press_have_files_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        for name in
            ["T_raster", "T_random2", "T_random2_time", "T_random2_re", "T_random2_re_time", "T_random1", "U_raster"]
        {
            std::fs::write(dir.path().join(format!("{name}.mat")), "").unwrap();
        }
        let found = recording_files(dir.path(), "T_").unwrap();
        let suffixes: Vec<&str> = found.iter().map(|files| files.suffix.as_str()).collect();
        assert_eq!(suffixes, ["", "_re"]);
        assert!(found[0].raster.is_some() && found[1].raster.is_none());
        assert!(found.iter().all(|files| files.positions.is_some() && files.compressive.is_some()));
    }
}
