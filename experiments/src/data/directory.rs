//! A directory of published recordings, in this project's layout or the original repository's.

use super::error::DataError;
use super::mat::{MatVariable, read_mat};
use spts_circuit::{
    Block, CodeScale, Converter, ConverterConfig, Mode, Recording, RecordingError, RecordingInfo, Seeding, WeightMode,
    Weights,
};
use spts_models::SkinLayout;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::path::{Path, PathBuf};

/// Rate of the published recordings, Hz: from the beat of the cells' timer interrupt against the measurement clock.
pub(super) const PUBLISHED_RATE_HZ: f64 = 64_300.0;

/// Taxels of the published skin, which is also the number of measurements in a frame.
const TAXELS: usize = 100;

/// Frames at the start of a published press in which nothing touches the skin.
pub(super) const IDLE_FRAMES: usize = 150;

/// Largest constant that the publication subtracted from a raster scan before it set negative volts to 0, hundredths of a volt; all are
/// whole hundredths, of either sign.
const MOST_SUBTRACTED: i32 = 20;

/// Library columns of one class; the first ten columns are the empty class 0.
const LIBRARY_COLUMNS_PER_CLASS: usize = 10;

/// A directory that holds at least one recording.
#[derive(Debug, Clone)]
pub struct RecordingsDir {
    root: PathBuf,
}

/// Dictionary, shifted dictionary and classifier library as published.
#[derive(Debug, Clone)]
pub struct Published {
    /// K-SVD dictionary, 100 × 100.
    pub dictionary: Matrix,
    /// Its shifted copies, 100 × 2450; absent when the file is.
    pub shifted: Option<Matrix>,
    /// Labelled raster images.
    pub library: Library,
}

impl RecordingsDir {
    /// Opens the directory `root`.
    ///
    /// # Errors
    /// [`DataError`] when it does not exist or holds no recording in a known layout.
    pub fn open(root: &Path) -> Result<Self, DataError> {
        std::fs::read_dir(root).map_err(|source| DataError::Io {
            path: root.to_owned(),
            source,
        })?;
        let dir = Self { root: root.to_owned() };
        let known = ["presses", "Measurements_Collected", "bounces", "Application_Data"];
        if known.iter().any(|folder| root.join(folder).is_dir()) {
            Ok(dir)
        } else {
            Err(DataError::NothingFound { path: root.to_owned() })
        }
    }

    /// The first of `candidates` (relative paths) that exists.
    fn find(&self, candidates: &[String]) -> Option<PathBuf> {
        candidates.iter().map(|c| self.root.join(c)).find(|p| p.is_file())
    }

    fn press_file(&self, object: &str, suffix: &str) -> Option<PathBuf> {
        self.find(&[
            format!("presses/{object}/{object}_{suffix}.mat"),
            format!("Measurements_Collected/{object}/{object}_{suffix}.mat"),
        ])
    }

    /// Raster session of `object`, or `None` when it is not there.
    ///
    /// # Errors
    /// [`DataError`] when the file is there but cannot be used.
    pub fn raster(&self, object: &str) -> Result<Option<Recording>, DataError> {
        let Some(path) = self.press_file(object, "raster") else {
            return Ok(None);
        };
        let blocks = split_blocks(&path, "D", &read_mat(&path, "D")?)?;
        let blocks = blocks
            .into_iter()
            .map(|volts| (volts.len() as u64 / TAXELS as u64, volts));
        recording(&path, Mode::Raster, Some(IDLE_FRAMES), blocks).map(Some)
    }

    /// Compressive session of `object`, or `None` when it is not there.
    ///
    /// # Errors
    /// [`DataError`] when a file is there but cannot be used, or `framePosition` does not fit the blocks.
    pub fn compressive(&self, object: &str) -> Result<Option<Recording>, DataError> {
        let Some(path) = self.press_file(object, "random2") else {
            return Ok(None);
        };
        let Some(time_path) = self.press_file(object, "random2_time") else {
            return Err(DataError::Missing {
                path: path.with_file_name(format!("{object}_random2_time.mat")),
                needed_by: format!("the compressive session of {object}"),
            });
        };
        let blocks = split_blocks(&path, "C", &read_mat(&path, "C")?)?;
        let positions = read_mat(&time_path, "framePosition")?;
        if positions.values.len() != blocks.len() {
            return Err(DataError::Shape {
                path: time_path,
                name: "framePosition",
                shape: positions.shape,
                expected: "one position a press",
            });
        }
        let mut positioned = Vec::with_capacity(blocks.len());
        for (index, (&value, volts)) in positions.values.iter().zip(blocks).enumerate() {
            positioned.push((frame_position(&time_path, index, value)?, volts));
        }
        recording(&path, Mode::Compressive, Some(IDLE_FRAMES), positioned).map(Some)
    }

    /// Compressive session of the bouncing ball, or `None` when it is not there. Its blocks follow each other without a
    /// gap, so block k ends at frame (k + 1) · frames; a fit of the contact with these rows leaves .34–.49 of the
    /// signal, with any others .93 or more.
    ///
    /// # Errors
    /// [`DataError`] when the file is there but cannot be used.
    pub fn bounces(&self) -> Result<Option<Recording>, DataError> {
        let Some(path) = self.find(&[
            "bounces/random2_tennis.mat".to_owned(),
            "Application_Data/ball_bouncing/random2_tennis.mat".to_owned(),
        ]) else {
            return Ok(None);
        };
        let blocks = split_blocks(&path, "C", &read_mat(&path, "C")?)?;
        let positioned = blocks
            .into_iter()
            .enumerate()
            .map(|(k, volts)| ((k as u64 + 1) * (volts.len() / TAXELS) as u64, volts));
        recording(&path, Mode::Compressive, None, positioned).map(Some)
    }

    /// Published dictionary and library, or `None` when one of the two files is missing.
    ///
    /// # Errors
    /// [`DataError`] when a file is there but cannot be used.
    pub fn published(&self) -> Result<Option<Published>, DataError> {
        let file = |name: &str| {
            let folders = ["", "Dictionary_Learning/", "SRC_Library/"];
            self.find(&folders.map(|folder| format!("{folder}{name}.mat")))
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

/// Recording of published blocks, each with its frame position; `idle_frames` are known for presses.
fn recording(
    path: &Path,
    mode: Mode,
    idle_frames: Option<usize>,
    blocks: impl IntoIterator<Item = (u64, Vec<f64>)>,
) -> Result<Recording, DataError> {
    let blocks: Vec<Block> = blocks
        .into_iter()
        .map(|(frame_position, volts)| Block {
            frame_position,
            idle_frames: idle_frames.map(|idle| idle.min(volts.len() / TAXELS)),
            volts,
        })
        .collect();
    let recording = published_info(mode, TAXELS).and_then(|mut info| {
        info.converter = published_converter(mode, &blocks);
        Recording::new(info, blocks)
    });
    recording.map_err(|source| DataError::Recording {
        path: path.to_owned(),
        source,
    })
}

/// What is known of the published skin, or of one like it with `taxels` taxels: its cells are seeded with their addresses.
pub(super) fn published_info(mode: Mode, taxels: usize) -> Result<RecordingInfo, RecordingError> {
    let skin = SkinLayout::default();
    let layout = if taxels == skin.taxels() {
        skin
    } else {
        SkinLayout::new(1, taxels, skin.pitch_m(), skin.electrode_m())
            .map_err(|_| RecordingError::Empty { field: "taxels" })?
    };
    let weight_mode = match mode {
        Mode::Raster => WeightMode::Raster,
        Mode::Compressive => WeightMode::Binary,
    };
    let weights = Weights::new(weight_mode, Seeding::Address, u32::try_from(taxels).unwrap_or(u32::MAX));
    Ok(RecordingInfo::new(layout, weights, PUBLISHED_RATE_HZ))
}

/// Scale that made the volts of `blocks`, every one of them bit for bit; `None` when it is not the published one. From a raster
/// scan a constant was subtracted that differs between sessions, and negative volts were set to 0.
fn published_converter(mode: Mode, blocks: &[Block]) -> Option<Converter> {
    let (offset_v, numerator, denominator) = match mode {
        Mode::Raster => (4.3, 508.0, 165.0),
        Mode::Compressive => (32.0, 11_140.0, 570.0),
    };
    let constants = (0..=MOST_SUBTRACTED)
        .flat_map(|k| [k, -k])
        .map(|k| Some(f64::from(k) / 100.0));
    let constants: Vec<Option<f64>> = match mode {
        Mode::Raster => std::iter::once(None).chain(constants).collect(),
        Mode::Compressive => vec![None],
    };
    let converters = constants.into_iter().filter_map(|subtract_v| {
        let scale = CodeScale::Divider {
            reference_v: 3.3,
            numerator,
            denominator,
        };
        Converter::new(ConverterConfig {
            offset_v,
            scale,
            max_code: 1023,
            subtract_v,
        })
        .ok()
    });
    converters
        .into_iter()
        .find(|c| blocks.iter().all(|block| c.made(&block.volts)))
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
pub(super) fn frame_position(path: &Path, index: usize, value: f64) -> Result<u64, DataError> {
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
