//! A directory of published recordings, in this project's layout or the original repository's.

use super::error::DataError;
use super::mat::{MatVariable, read_mat};
use spts_circuit::{Block, Mode, Recording};
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::path::{Path, PathBuf};

/// Rate of the published recordings, Hz: from the beat of the cells' timer interrupt against the measurement clock.
pub(super) const PUBLISHED_RATE_HZ: f64 = 64_300.0;

/// Taxels of the published skin, which is also the number of measurements in a frame.
const TAXELS: usize = 100;

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
        recording(&path, Mode::Raster, blocks).map(Some)
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
        recording(&path, Mode::Compressive, positioned).map(Some)
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
        recording(&path, Mode::Compressive, positioned).map(Some)
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

fn recording(
    path: &Path,
    mode: Mode,
    blocks: impl IntoIterator<Item = (u64, Vec<f64>)>,
) -> Result<Recording, DataError> {
    let blocks = blocks
        .into_iter()
        .map(|(frame_position, volts)| Block { frame_position, volts })
        .collect();
    Recording::new(mode, TAXELS, TAXELS, PUBLISHED_RATE_HZ, blocks).map_err(|source| DataError::Recording {
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
