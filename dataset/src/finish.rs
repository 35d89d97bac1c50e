//! The last step of making a data set: checks everything and describes it.

use crate::card::{card, croissant};
use crate::error::DatasetError;
use crate::folder::{DATA_FOLDER, Dataset, HEAD_FILE, SPEC_FILE};
use crate::shard::{check_shard, shard_name};
use crate::statistics::Statistics;
use serde::Serialize;
use spts::output::{Manifest, is_temporary, remove_left, write_bytes, write_json};
use spts::progress::Progress;
use std::collections::BTreeSet;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// Files that describe a whole data set.
const STATISTICS_FILE: &str = "statistics.json";
const CARD_FILE: &str = "README.md";
const CROISSANT_FILE: &str = "croissant.json";

/// Summary of a complete data set: what `spts dataset finish` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finished {
    /// Number of rows.
    pub rows: u64,
    /// Number of files with rows.
    pub shards: u64,
    /// Their size, bytes.
    pub bytes: u64,
    /// SHA-256 of the names and contents of all files with rows. It does not depend on where the data set was made. In
    /// its folder it is the SHA-256 of the output of `sha256sum data/*.parquet`.
    pub digest: String,
}

impl Dataset {
    /// Checks that all files exist and are complete, and writes statistics, card, `croissant.json` and, last,
    /// `manifest.json`.
    ///
    /// # Errors
    /// [`DatasetError`] if a file is missing, damaged, or not part of this data set, or cannot be written.
    pub fn finish(&self, progress: &dyn Progress) -> Result<Finished, DatasetError> {
        let spec = self.spec();
        for path in self.check_files(progress)? {
            remove_left(&path).map_err(DatasetError::read(&path))?;
        }
        let names: Vec<String> = (0..spec.shards()).map(|k| shard_name(k, spec.shards())).collect();
        let data = self.folder().join(DATA_FOLDER);
        let statistics = Statistics::of(self, progress)?;
        let size = |name: &String| std::fs::metadata(data.join(name)).map(|m| m.len());
        let bytes = names
            .iter()
            .map(size)
            .sum::<Result<u64, _>>()
            .map_err(DatasetError::read(&data))?;
        let at = |name: &str| -> PathBuf { self.folder().join(name) };
        write_json(&at(STATISTICS_FILE), &statistics)?;
        write_bytes(&at(CARD_FILE), card(spec, &statistics, bytes).as_bytes())?;
        let listed: Vec<String> = names.iter().map(|name| format!("{DATA_FOLDER}/{name}")).collect();
        write_json(&at(CROISSANT_FILE), &croissant(spec))?;
        let described = [HEAD_FILE, SPEC_FILE, STATISTICS_FILE, CARD_FILE, CROISSANT_FILE].map(str::to_owned);
        let manifest = Manifest::write_of(self.folder(), &[&described[..], &listed].concat())?;
        Ok(Finished {
            rows: statistics.rows,
            shards: spec.shards(),
            bytes,
            digest: manifest.digest_of(DATA_FOLDER),
        })
    }

    /// Checks that all files are there, whole and of this data set, and that there are no others. Returns the files
    /// that runs which were ended have left behind.
    ///
    /// # Errors
    /// [`DatasetError`] when a file is missing, damaged, of another data set, or of no data set.
    pub(crate) fn check_files(&self, progress: &dyn Progress) -> Result<Vec<PathBuf>, DatasetError> {
        let spec = self.spec();
        let names: BTreeSet<String> = (0..spec.shards()).map(|k| shard_name(k, spec.shards())).collect();
        progress.stage("files checked", usize::try_from(spec.shards()).ok());
        let mut missing = Vec::new();
        for shard in 0..spec.shards() {
            let path = self.shard_file(shard);
            if path.symlink_metadata().is_ok() {
                check_shard(spec, shard, &path)?;
            } else {
                missing.push(shard);
            }
            progress.step();
        }
        progress.end();
        if let Some(first) = missing.first() {
            let (count, all) = (missing.len(), spec.shards());
            let problem =
                format!("is missing, as {count} of {all} files are: run `spts dataset make` with this folder again");
            return Err(DatasetError::file(self.shard_file(*first), problem));
        }
        let data = self.folder().join(DATA_FOLDER);
        for entry in entries(&data)? {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !is_temporary(&name) && !names.contains(&name) {
                return Err(DatasetError::file(
                    entry.path(),
                    "is not of this data set; move it away",
                ));
            }
        }
        let all = [entries(self.folder())?, entries(&data)?].into_iter().flatten();
        let left = all.filter(|entry| is_temporary(&entry.file_name().to_string_lossy()));
        Ok(left.map(|entry| entry.path()).collect())
    }
}

/// What `folder` holds.
fn entries(folder: &Path) -> Result<Vec<DirEntry>, DatasetError> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect);
    entries.map_err(DatasetError::read(folder))
}
