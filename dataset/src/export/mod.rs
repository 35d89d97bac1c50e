//! Data sets in the layouts of other programs.

mod lerobot;
mod rows;
mod tar;
mod webdataset;

use crate::error::DatasetError;
use crate::folder::{DATA_FOLDER, Dataset};
use crate::shard::shard_name;
use serde::Serialize;
use spts::output::{Manifest, OutputFolder};
use spts::progress::Progress;
use std::collections::BTreeMap;
use std::path::Path;

/// Options of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExportOptions {
    /// Largest number of rows in a tar file; [1, 10^6]. Default 10,000. Only for `webdataset`.
    pub rows_per_tar: Option<u64>,
}

/// What a layout of another program reports after an export: rows of each split, and episodes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Written {
    /// Number of rows in every split that is not empty.
    pub splits: BTreeMap<&'static str, u64>,
    /// Number of episodes; `None` for a format without episodes.
    pub episodes: Option<u64>,
}

/// Summary of a complete export of a data set: what `spts dataset export` prints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Exported {
    /// Name of the format.
    pub format: &'static str,
    /// Number of rows.
    pub rows: u64,
    /// Number of episodes; `None` for a format without episodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes: Option<u64>,
    /// Number of rows in every split that is not empty.
    pub splits: BTreeMap<&'static str, u64>,
    /// Number of files without the manifest.
    pub files: u64,
    /// Their size, bytes.
    pub bytes: u64,
    /// SHA-256 of the names and contents of all files.
    pub digest: String,
}

/// Fills an output folder with a data set.
pub type WriteExport<'a> = Box<dyn FnOnce(&OutputFolder, &dyn Progress) -> Result<Written, DatasetError> + 'a>;

/// Checks whether the format can hold a data set before any row is read, and returns the function that writes it.
pub type PrepareExport = for<'a> fn(&'a Dataset, &ExportOptions) -> Result<WriteExport<'a>, DatasetError>;

/// The formats: name, description, and the function that prepares an export.
pub const EXPORTS: &[(&str, &str, PrepareExport)] = &[
    (
        "lerobot",
        "LeRobot v3.0: a press is an episode, a row is a frame",
        lerobot::prepare,
    ),
    (
        "webdataset",
        "WebDataset: tar files with JSON and NumPy arrays for every row",
        webdataset::prepare,
    ),
];

/// The splits in the order in which exports write them.
const SPLITS: [&str; 3] = ["train", "validation", "test"];
/// Copy of the spec in the folder of an export.
const SPEC_FILE: &str = "spec.toml";
/// Start of the hidden names that an output folder has of its own.
const HIDDEN: &str = ".spts";

impl Dataset {
    /// Writes the data set into the folder `out`, in the format called `format` in [`EXPORTS`]. The folder must be
    /// missing or empty. Afterwards it holds the whole export or nothing.
    ///
    /// # Errors
    /// [`DatasetError`] if the format does not exist or cannot hold the data set, a file of the data set is missing or
    /// damaged, `out` is not empty, or a file cannot be written.
    pub fn export(
        &self,
        format: &str,
        out: &Path,
        options: &ExportOptions,
        progress: &dyn Progress,
    ) -> Result<Exported, DatasetError> {
        let Some((format, _, prepare)) = EXPORTS.iter().find(|(name, ..)| *name == format) else {
            let known: Vec<&str> = EXPORTS.iter().map(|(name, ..)| *name).collect();
            let format = format.escape_debug();
            return Err(DatasetError::Export(format!(
                "`format` = {format}; valid: {}",
                known.join(", ")
            )));
        };
        let write = prepare(self, options)?;
        let folder = OutputFolder::open(out)?;
        check_empty(out)?;
        self.check_files(progress)?;
        self.check_manifest()?;
        progress.stage("rows exported", usize::try_from(self.spec().config().rows).ok());
        let written = write(&folder, progress).and_then(|written| {
            let spec = spts::output::write_bytes(&folder.path(SPEC_FILE), self.spec().text().as_bytes());
            Ok(spec.map(|()| written)?)
        });
        progress.end();
        let written = written.map_err(|error| shown(&folder, error))?;
        let names = folder.commit()?;
        let size = |name: &String| std::fs::metadata(out.join(name)).map(|file| file.len());
        let bytes = names.iter().map(size).sum::<Result<u64, _>>();
        Ok(Exported {
            format,
            rows: written.splits.values().sum(),
            episodes: written.episodes,
            splits: written.splits,
            files: names.len() as u64,
            bytes: bytes.map_err(DatasetError::read(out))?,
            digest: Manifest::read(out)
                .map(|manifest| manifest.digest_of(""))
                .unwrap_or_default(),
        })
    }

    /// Checks that the files of rows are those that the manifest lists, where the data set has been finished.
    fn check_manifest(&self) -> Result<(), DatasetError> {
        let Some(manifest) = Manifest::read(self.folder()) else {
            return Ok(());
        };
        for shard in 0..self.spec().shards() {
            let name = format!("{DATA_FOLDER}/{}", shard_name(shard, self.spec().shards()));
            let path = self.shard_file(shard);
            let unchanged = manifest.is_unchanged(self.folder(), &name);
            if !unchanged.map_err(DatasetError::read(&path))? {
                let problem = "is not the file that manifest.json lists; remove it and run `spts dataset make` with \
                               this folder again";
                return Err(DatasetError::file(path, problem));
            }
        }
        Ok(())
    }
}

/// Refuses a folder that holds something.
fn check_empty(out: &Path) -> Result<(), DatasetError> {
    if !out.exists() {
        return Ok(());
    }
    for entry in std::fs::read_dir(out).map_err(DatasetError::read(out))? {
        let entry = entry.map_err(DatasetError::read(out))?;
        if !entry.file_name().to_string_lossy().starts_with(HIDDEN) {
            let problem = "is in the way; an export needs a folder that is empty or does not exist";
            return Err(DatasetError::file(entry.path(), problem));
        }
    }
    Ok(())
}

/// The error with the final place of a file in place of where it waited.
fn shown(folder: &OutputFolder, error: DatasetError) -> DatasetError {
    match error {
        DatasetError::Output(error) => folder.unstaged(error).into(),
        DatasetError::File { path, problem } => DatasetError::File {
            path: folder.final_path(&path),
            problem,
        },
        other => other,
    }
}
