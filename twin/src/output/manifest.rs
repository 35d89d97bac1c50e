//! The manifest: which files of a folder a run has written.

use super::disk::unwritable;
use super::files::write_json;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use spts_input::Refusal;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::Metadata;
use std::io::{self, Read as _};
use std::path::{Component, Path};

/// The file that lists the files that a run has written.
pub const MANIFEST_FILE: &str = "manifest.json";
const FORMAT: &str = "spts-results";
const SCHEMA: u64 = 1;
/// Largest manifest that is read, bytes: 100,000 files.
const MAX_BYTES: u64 = 1 << 25;
/// Bytes that are hashed at a time.
const PIECE: usize = 1 << 16;

/// The files that a run has written.
///
/// ```
/// use spts::output::{Manifest, OutputFolder, write_bytes};
///
/// # let path = std::env::temp_dir().join(format!("spts-doc-manifest-{}", std::process::id()));
/// let folder = OutputFolder::open(&path)?;
/// write_bytes(&folder.path("scores.csv"), b"iou\n0.8\n")?;
/// folder.commit()?;
/// let manifest = Manifest::read(&path).expect("a run has left its manifest");
/// assert!(manifest.names().eq(["scores.csv"]));
/// # std::fs::remove_dir_all(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    format: String,
    schema: u64,
    /// Files by their names below the folder, with `/` between the parts of a name.
    files: BTreeMap<String, FileEntry>,
}

/// What is known of a file.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileEntry {
    /// Size, bytes, and SHA-256 of the content in hexadecimal digits. Both are absent for a file that depends on the
    /// machine or the time of the run, so that repeated runs write the same manifest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sha256: Option<String>,
}

impl FileEntry {
    /// The entry of the file at `path`.
    fn of(path: &Path) -> io::Result<Self> {
        let (mut file, bytes) = spts_input::open(path, u64::MAX)?;
        let (mut hash, mut piece) = (Sha256::new(), vec![0; PIECE]);
        while let read @ 1.. = file.read(&mut piece)? {
            hash.update(&piece[..read]);
        }
        Ok(Self { bytes: Some(bytes), sha256: Some(in_digits(hash)) })
    }
}

impl Manifest {
    /// Writes the manifest of the files `names` of `folder` into that folder. No two runs write alike what is `timed`.
    ///
    /// # Errors
    /// [`Refusal`] if a file cannot be read, or the manifest cannot be written.
    pub fn write_of(folder: &Path, names: &[String], timed: &BTreeSet<String>) -> Result<Self, Refusal> {
        let mut files = BTreeMap::new();
        for name in names {
            let path = folder.join(name);
            let entry = match timed.contains(name) {
                true => FileEntry::default(),
                false => FileEntry::of(&path).map_err(unwritable(&path))?,
            };
            files.insert(name.clone(), entry);
        }
        let manifest = Self { format: FORMAT.to_owned(), schema: SCHEMA, files };
        write_json(&folder.join(MANIFEST_FILE), &manifest)?;
        Ok(manifest)
    }

    /// SHA-256 of the names and digests of the listed files below the folder `within`, in order of name. Equal files
    /// give equal digests wherever they lie.
    pub fn digest_of(&self, within: &str) -> String {
        let listed = self.files.iter().filter(|(name, _)| Path::new(name).starts_with(within));
        let lines = listed.map(|(name, entry)| format!("{}  {name}\n", entry.sha256.as_deref().unwrap_or_default()));
        in_digits(Sha256::new().chain_update(lines.collect::<String>()))
    }

    /// The manifest of `folder`, if a run has left one. A file of that name that no run has written does not count.
    pub fn read(folder: &Path) -> Option<Self> {
        let path = folder.join(MANIFEST_FILE);
        path.symlink_metadata().ok().filter(Metadata::is_file)?;
        let bytes = spts_input::read(&path, MAX_BYTES).ok()?;
        let manifest: Self = serde_json::from_slice(&bytes).ok()?;
        let ours = manifest.format == FORMAT && manifest.schema == SCHEMA;
        (ours && manifest.files.keys().all(|name| is_below(name))).then_some(manifest)
    }

    /// Names of the files, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Whether the file `name` of `folder` is as the run wrote it, if the manifest lists it at all.
    ///
    /// # Errors
    /// [`io::Error`] if the file cannot be read.
    pub fn holds(&self, folder: &Path, name: &str) -> io::Result<bool> {
        Ok(!self.lists(name) || self.is_unchanged(folder, name)?)
    }

    /// Whether a run has written the file `name`.
    pub(super) fn lists(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// Whether the file `name` of `folder` is still as the run wrote it; `false` for a file that is not listed.
    ///
    /// # Errors
    /// [`io::Error`] if the file cannot be read.
    pub fn is_unchanged(&self, folder: &Path, name: &str) -> io::Result<bool> {
        let path = folder.join(name);
        match self.files.get(name) {
            Some(entry) if path.symlink_metadata().is_ok_and(|found| found.is_file()) => {
                Ok(*entry == FileEntry::default() || *entry == FileEntry::of(&path)?)
            }
            _ => Ok(false),
        }
    }
}

/// Checks that the files `names` of `folder` are those that the last run wrote, and refuses files that have changed.
/// The manifest may lie in `folder` or in one of the two folders above. A folder without a manifest passes.
///
/// # Errors
/// [`Refusal`] for a file that has changed or cannot be read.
pub fn check_whole(folder: &Path, names: &[&str]) -> Result<(), Refusal> {
    let Ok(whole) = folder.canonicalize() else {
        return Ok(());
    };
    let listing = whole.ancestors().take(3).find_map(|above| Some((above, Manifest::read(above)?)));
    let Some((above, manifest)) = listing else {
        return Ok(());
    };
    let below = whole.strip_prefix(above).unwrap_or(Path::new(""));
    for name in names {
        let (path, listed) = (folder.join(name), below.join(name).to_string_lossy().into_owned());
        if !manifest.holds(above, &listed).map_err(Refusal::in_file(&path))? {
            let advice =
                "the folder holds results of two runs, or the file was changed by hand: then delete the manifest";
            return Err(changed(&path, above, advice));
        }
    }
    Ok(())
}

/// The error that `path` is not as the manifest in `folder` lists it.
pub(super) fn changed(path: &Path, folder: &Path, advice: &str) -> Refusal {
    let manifest = folder.join(MANIFEST_FILE);
    let problem = format!("is not the file that {} lists; {advice}", manifest.display());
    Refusal::new(problem).at(path.display())
}

/// Whether `name` stays below the folder that it is joined to.
fn is_below(name: &str) -> bool {
    !name.is_empty() && Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

/// `hash` in hexadecimal digits.
fn in_digits(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
