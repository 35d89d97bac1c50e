//! The folder of a data set, and how its files are divided among workers.

use crate::file::{check_shard, failed, refused, shard_name, shard_rows, version, write_shard};
use crate::spec::{Spec, SpecError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts::Refusal;
use spts::output::{MANIFEST_FILE, Manifest, is_temporary, json_text, no_folder, write_new};
use spts::progress::Progress;
use spts::session::parse_json;
use spts_circuit::RecordingInfo;
use std::io;
use std::path::{Path, PathBuf};

/// File that says what the folder holds.
pub(crate) const HEAD_FILE: &str = "dataset.json";
/// The spec, its overrides in it.
pub(crate) const SPEC_FILE: &str = "spec.toml";
/// Folder of the files of rows.
pub(crate) const DATA_FOLDER: &str = "data";
/// Version of the layout of the folder.
const FORMAT: u32 = 1;
/// Largest head and spec that are read, bytes.
const MAX_TEXT_BYTES: u64 = 1 << 22;

/// What a folder holds, before any of its rows is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Head {
    format: u32,
    name: String,
    rows: u64,
    rows_per_shard: u64,
    shards: u64,
    spec_sha256: String,
    version: String,
    /// Layout, weights, rate and converter of the wire. With `first_row` of a row, they give its rows of Φ.
    recording: RecordingInfo,
}

impl Head {
    fn of(spec: &Spec) -> Self {
        Self {
            format: FORMAT,
            name: spec.config().name.clone(),
            rows: spec.config().rows,
            rows_per_shard: spec.rows_per_shard(),
            shards: spec.shards(),
            spec_sha256: spec.identity().to_owned(),
            version: version().to_owned(),
            recording: spec.recording().clone(),
        }
    }
}

/// A data set in its folder: `dataset.json` describes it, `spec.toml` is its specification, and `data/` holds its rows.
#[derive(Debug, Clone)]
pub struct Dataset {
    folder: PathBuf,
    spec: Spec,
    /// What this run has put into the folder beside [`DATA_FOLDER`], and the folder if it is new, in the order in
    /// which they can be removed.
    begun: Vec<PathBuf>,
}

/// What a folder holds of a data set: what `spts dataset info` prints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Info {
    /// Name.
    pub name: String,
    /// Number of rows of the whole data set.
    pub rows: u64,
    /// Number of files of the whole data set.
    pub shards: u64,
    /// Number of rows in a file.
    pub rows_per_shard: u64,
    /// Number of existing files.
    pub made: u64,
    /// Their size, bytes.
    pub bytes: u64,
    /// SHA-256 of the specification and of the files that it names.
    pub spec_sha256: String,
    /// SHA-256 of all rows; `None` until the data set is finished.
    pub digest: Option<String>,
}

/// What one run of `spts dataset make` has added to a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Made {
    /// Number of new rows.
    pub rows: u64,
    /// Number of new files.
    pub shards: u64,
    /// Number of files that already existed and were complete.
    pub skipped: u64,
}

impl Dataset {
    /// The data set of `spec` in `folder`. The folder must be missing, empty, or hold a part of this data set.
    ///
    /// # Errors
    /// [`Refusal`] if the folder holds something else, or cannot be written.
    pub fn begin(folder: &Path, spec: Spec) -> Result<Self, Refusal> {
        let data = folder.join(DATA_FOLDER);
        let head_file = folder.join(HEAD_FILE);
        let head = Head::of(&spec);
        // looked for before the head: what another run of this data set makes has a head from then on
        let other = first_entry(folder)?;
        let has_head = head_file.symlink_metadata().is_ok();
        check_head(&head_file, &head)?;
        if let Some(other) = other.filter(|_| !has_head) {
            let problem = "is not of a data set; choose an empty folder, or one that `spts dataset make` began";
            return Err(refused(other, problem));
        }
        let is_new = folder.symlink_metadata().is_err();
        std::fs::create_dir_all(folder).map_err(|source| no_folder(folder, source))?;
        // of two runs that begin at once, the one whose spec is first has the folder
        let spec_file = folder.join(SPEC_FILE);
        let mut begun = vec![head_file.clone()];
        if write_new(&spec_file, spec.text().as_bytes())? {
            begun.push(spec_file);
        } else {
            let text = spts_input::read(&spec_file, MAX_TEXT_BYTES).map_err(failed(&spec_file))?;
            if text != spec.text().as_bytes() {
                check_head(&head_file, &head)?;
                let problem = "is not the spec of this data set and is not replaced; choose another folder";
                return Err(refused(spec_file, problem));
            }
        }
        std::fs::create_dir_all(&data).map_err(|source| no_folder(&data, source))?;
        // the head last, so that what has one has all
        begun.extend(is_new.then(|| folder.to_owned()));
        if !write_new(&head_file, json_text(&head_file, &head)?.as_bytes())? {
            check_head(&head_file, &head)?;
            begun.clear();
        }
        Ok(Self { folder: folder.to_owned(), spec, begun })
    }

    /// Opens the data set in `folder`. Files that its specification names are looked up in `files`.
    ///
    /// # Errors
    /// [`Refusal`] if there is no data set, or another version of this library made it.
    pub fn open(folder: &Path, files: &Path) -> Result<Self, Refusal> {
        let head_file = folder.join(HEAD_FILE);
        let found = read_head(&head_file)?;
        let path = folder.join(SPEC_FILE);
        let text = spts_input::read_text(&path, MAX_TEXT_BYTES).map_err(failed(&path))?;
        let spec = Spec::read(&text, &toml::Table::new(), files).map_err(|error| match error {
            SpecError::Folder(error) | SpecError::Mesh(error) => {
                let files = files.display();
                let problem = format!("names a file that is not in {files} ({error}); `--files` says where it is");
                refused(&path, problem)
            }
            SpecError::Refused(refusal) => refusal.at(path.display()),
        })?;
        let head = Head::of(&spec);
        if found != head {
            return Err(other_data_set(&head_file, &found, &head));
        }
        Ok(Self { folder: folder.to_owned(), spec, begun: Vec::new() })
    }

    /// The specification.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of file number `shard`.
    pub(crate) fn shard_file(&self, shard: u64) -> PathBuf {
        let name = shard_name(shard, self.spec.shards());
        self.folder.join(DATA_FOLDER).join(name)
    }

    /// State of the data set.
    pub fn info(&self) -> Info {
        let sizes = (0..self.spec.shards()).filter_map(|k| std::fs::metadata(self.shard_file(k)).ok());
        let sizes: Vec<u64> = sizes.map(|file| file.len()).collect();
        Info {
            name: self.spec.config().name.clone(),
            rows: self.spec.config().rows,
            shards: self.spec.shards(),
            rows_per_shard: self.spec.rows_per_shard(),
            made: sizes.len() as u64,
            bytes: sizes.iter().sum(),
            spec_sha256: self.spec.identity().to_owned(),
            digest: Manifest::read(&self.folder).map(|manifest| manifest.digest_of(DATA_FOLDER)),
        }
    }

    /// Makes the missing files of `part`, one file a thread. If it fails before there is any file, what
    /// [`Dataset::begin`] has put into the folder is removed, and another spec may have it.
    ///
    /// # Errors
    /// [`Refusal`] if an existing file is not valid, a row cannot be made, or a file cannot be written.
    pub fn make(&self, part: Part, progress: &dyn Progress) -> Result<Made, Refusal> {
        let mut made = Made { rows: 0, shards: 0, skipped: 0 };
        self.check_whole(part.shards(self.spec.shards()))?;
        for shard in part.shards(self.spec.shards()) {
            if self.is_made(shard)? {
                made.skipped += 1;
            } else {
                let rows = shard_rows(&self.spec, shard);
                made.rows += rows.end - rows.start;
                made.shards += 1;
            }
        }
        progress.stage("rows", usize::try_from(made.rows).ok());
        let written = part.shards(self.spec.shards()).par_bridge().try_for_each(|shard| {
            let path = self.shard_file(shard);
            if path.symlink_metadata().is_ok() {
                return Ok(());
            }
            write_shard(&self.spec, shard, &path, &|| progress.step())
        });
        progress.end();
        // refused where a file of rows is, or is being written by another worker
        if written.is_err() && !self.begun.is_empty() && std::fs::remove_dir(self.folder.join(DATA_FOLDER)).is_ok() {
            for path in &self.begun {
                // what stays is not in the way of this spec
                let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
            }
        }
        written.map(|()| made)
    }

    /// Checks that those of the files `shards` that are there are as the manifest lists them, if the data set is
    /// finished.
    pub(crate) fn check_whole(&self, shards: impl Iterator<Item = u64>) -> Result<(), Refusal> {
        let Some(manifest) = Manifest::read(&self.folder) else { return Ok(()) };
        for shard in shards {
            let path = self.shard_file(shard);
            let name = format!("{DATA_FOLDER}/{}", shard_name(shard, self.spec.shards()));
            if path.symlink_metadata().is_ok() && !manifest.holds(&self.folder, &name).map_err(failed(&path))? {
                let manifest = self.folder.join(MANIFEST_FILE);
                let problem = format!(
                    "is not the file that {} lists; remove it, and `spts dataset make` makes it again",
                    manifest.display()
                );
                return Err(refused(path, problem));
            }
        }
        Ok(())
    }

    /// Whether file number `shard` is there, which is then whole.
    fn is_made(&self, shard: u64) -> Result<bool, Refusal> {
        let path = self.shard_file(shard);
        match std::fs::symlink_metadata(&path) {
            Ok(_) => check_shard(&self.spec, shard, &path).map(|()| true),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(failed(&path)(error)),
        }
    }
}

/// Refuses a folder whose head, if there is one, is not `needed`.
fn check_head(path: &Path, needed: &Head) -> Result<(), Refusal> {
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    let found = read_head(path)?;
    if found == *needed { Ok(()) } else { Err(other_data_set(path, &found, needed)) }
}

fn read_head(path: &Path) -> Result<Head, Refusal> {
    let text = spts_input::read_text(path, MAX_TEXT_BYTES).map_err(failed(path))?;
    parse_json(path, &text).map_err(|refusal| refusal.reworded(|said| format!("{said}; is not the head of a data set")))
}

/// The error of a folder that holds the data set `found`.
fn other_data_set(path: &Path, found: &Head, needed: &Head) -> Refusal {
    let problem = if found.spec_sha256 == needed.spec_sha256 && found.version != needed.version {
        format!(
            "was begun by version {}; this is {}, whose rows may differ: choose another folder",
            found.version, needed.version
        )
    } else {
        format!(
            "another data set was begun here (\"{}\", {} rows, spec {}); choose another folder, or remove this one",
            found.name.escape_debug(),
            found.rows,
            found.spec_sha256.chars().take(12).collect::<String>()
        )
    };
    refused(path, problem)
}

/// The first entry of `folder` that is not a file on its way to its name; none where there is no folder.
fn first_entry(folder: &Path) -> Result<Option<PathBuf>, Refusal> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(folder)(error)),
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(failed(folder))?;
        let name = entry.file_name();
        // what a run that was ended before it had made a head has left
        let begun = name == DATA_FOLDER || name == SPEC_FILE || is_temporary(&name.to_string_lossy());
        if !begun {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found.into_iter().next())
}

/// A worker's part: the files k with k mod `of` = `worker`. The set of files does not depend on it.
///
/// ```
/// use spts_dataset::Part;
///
/// let part = Part::parse("1/4")?;
/// assert_eq!(part.shards(10).collect::<Vec<_>>(), [1, 5, 9]);
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of this worker, from 0.
    pub worker: u64,
    /// Number of workers.
    pub of: u64,
}

/// Variables of Slurm's job arrays and of Kubernetes' indexed jobs.
const SLURM: [&str; 3] = ["SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT"];
const KUBERNETES: &str = "JOB_COMPLETION_INDEX";

impl Part {
    /// The part of a single worker: all files.
    pub const WHOLE: Self = Self { worker: 0, of: 1 };

    /// Reads the text "i/n": worker i of n, counted from 0.
    ///
    /// # Errors
    /// [`Refusal`] if the text is not a valid part.
    pub fn parse(text: &str) -> Result<Self, Refusal> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((worker, of)) if worker < of => Ok(Self { worker, of }),
            _ => Err(Refusal::new(format!(
                "`--shard` = {}: valid: i/n with whole numbers 0 ≤ i < n",
                text.escape_debug()
            ))),
        }
    }

    /// The part of this worker, found with `variable`, which reads environment variables. In a Slurm array: the task's
    /// number minus the array's first, out of the number of tasks. In a Kubernetes indexed job: the job's index, out of
    /// `workers`. `None` outside of both.
    ///
    /// # Errors
    /// [`Refusal`] if a variable is missing or not a number, or the worker is out of range.
    pub fn from_environment(
        variable: impl Fn(&str) -> Option<String>,
        workers: Option<u64>,
    ) -> Result<Option<Self>, Refusal> {
        let number = |name: &str| -> Result<Option<u64>, Refusal> {
            let Some(text) = variable(name) else { return Ok(None) };
            let number = text.trim().parse().map(Some);
            number.map_err(|_| Refusal::new(format!("{name} = {}: a whole number is needed", text.escape_debug())))
        };
        let [task, first, tasks] = SLURM;
        let (worker, of, name) = if let Some(task_number) = number(task)? {
            let first_number = number(first)?.unwrap_or(0);
            let worker = task_number.checked_sub(first_number);
            let worker = worker
                .ok_or_else(|| Refusal::new(format!("{task} = {task_number} is below {first} = {first_number}")))?;
            let count = number(tasks)?;
            (worker, count.or(workers), tasks)
        } else if let Some(index) = number(KUBERNETES)? {
            (index, workers, "`--shards`")
        } else {
            return Ok(None);
        };
        let Some(of) = of else {
            return Err(Refusal::new(format!("{name} is needed beside worker number {worker}")));
        };
        if worker >= of {
            return Err(Refusal::new(format!("worker number {worker} is not one of {of}, which count from 0")));
        }
        Ok(Some(Self { worker, of }))
    }

    /// Numbers of the files that this worker makes, of the `shards` files of the data set, counted from 0.
    pub fn shards(self, shards: u64) -> impl Iterator<Item = u64> {
        (self.worker..shards).step_by(usize::try_from(self.of).unwrap_or(usize::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn workers_share_all_files() {
        for of in 1..6 {
            let mut all: Vec<u64> = (0..of).flat_map(|worker| Part { worker, of }.shards(17)).collect();
            all.sort_unstable();
            assert_eq!(all, (0..17).collect::<Vec<_>>());
        }
        for bad in ["", "1", "4/4", "-1/4", "a/b", "1/0", "1/4/2", "1.0/4"] {
            assert!(Part::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn clusters_tell_their_workers() {
        let part = |variables: &[(&str, &str)], workers| {
            let variables: BTreeMap<_, _> = variables.iter().copied().collect();
            Part::from_environment(|name| variables.get(name).map(|v| (*v).to_owned()), workers)
                .map_err(|e| e.to_string())
        };
        let slurm =
            |id| vec![("SLURM_ARRAY_TASK_ID", id), ("SLURM_ARRAY_TASK_MIN", "3"), ("SLURM_ARRAY_TASK_COUNT", "4")];
        assert_eq!(part(&[], None), Ok(None));
        assert_eq!(part(&slurm("3"), None), Ok(Some(Part { worker: 0, of: 4 })));
        assert_eq!(part(&slurm("6"), None), Ok(Some(Part { worker: 3, of: 4 })));
        assert!(part(&slurm("7"), None).unwrap_err().contains("is not one of 4"));
        assert!(part(&slurm("2"), None).unwrap_err().contains("is below"));
        assert!(part(&slurm("x"), None).unwrap_err().contains("a whole number"));
        let kubernetes = [("JOB_COMPLETION_INDEX", "2")];
        assert_eq!(part(&kubernetes, Some(8)), Ok(Some(Part { worker: 2, of: 8 })));
        assert!(part(&kubernetes, None).unwrap_err().contains("`--shards` is needed"));
    }
}
