//! The folder for the results of one run. It changes as a whole, and files that no run has written stay.

use super::atomic::RANDOM;
use super::commit::{self, PLACING};
use super::disk;
use super::error::OutputError;
use super::lock::{LOCK_FILE, Lock};
use super::manifest::{MANIFEST_FILE, Manifest};
use crate::cleanup::{Entry, Leftover, listed};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// Start of the names of what waits to be put in place. Nothing else has such names, so what a run that was killed has
/// left waiting can be removed.
pub(super) const WAITING: &str = ".spts-";

/// A folder that a run is filling. From its opening on, no other run can open it. The results wait in a hidden folder
/// inside until [`OutputFolder::commit`]. Without a commit the folder stays unchanged.
#[derive(Debug)]
pub struct OutputFolder {
    /// The folder without symbolic links, because the exchange must act on the folder itself.
    folder: PathBuf,
    /// The folder as the user named it.
    shown: PathBuf,
    stage: PathBuf,
    timed: BTreeSet<String>,
    lock: Option<Lock>,
    /// Lets a signal remove the waiting results; dropped before they move.
    entry: Option<Entry>,
    /// Folders created for this run, deepest first.
    made: Vec<PathBuf>,
    /// Lets a signal remove those of the created folders that are empty.
    _made_entry: Entry,
}

impl OutputFolder {
    /// Opens the folder `path` for a run, and creates it and its parents where they are missing. `files` are the known
    /// names of results: a name that could not be written at the end is refused now.
    ///
    /// # Errors
    /// [`OutputError`] if `path` is a file, the folder cannot be created or written to, another run is writing to it,
    /// or a file that no run has written has the name of a result.
    pub fn open(path: &Path, files: &[&str]) -> Result<Self, OutputError> {
        let made = make(path)?;
        let failed = OutputError::write(path);
        let ((), made_entry) = listed(|| Ok(()), |()| Leftover::EmptyFolders(made.clone())).map_err(failed)?;
        let folder = path.canonicalize().map_err(OutputError::write(path));
        let opened = folder.and_then(|folder| {
            let lock = Lock::take(&folder).map_err(|error| error.relocated(&|_| path.to_owned()))?;
            let failed = OutputError::write(path);
            commit::recover(&folder).map_err(&failed)?;
            commit::sweep(&folder).map_err(&failed)?;
            let manifest = Manifest::read(&folder);
            for name in files.iter().chain([&MANIFEST_FILE]) {
                let ours = check_ours(&folder, manifest.as_ref(), name);
                ours.map_err(|error| error.relocated(&|_| path.join(name)))?;
            }
            let stage = listed(|| make_stage(&folder), |stage| Leftover::Folder(stage.clone()));
            Ok((folder, lock, stage.map_err(&failed)?))
        });
        match opened {
            Ok((folder, lock, (stage, entry))) => Ok(Self {
                folder,
                shown: path.to_owned(),
                stage,
                timed: BTreeSet::new(),
                lock: Some(lock),
                entry: Some(entry),
                made,
                _made_entry: made_entry,
            }),
            Err(error) => {
                unmake(&made);
                Err(error)
            }
        }
    }

    /// Where to write the result `name`. It may lie in a folder (`tables/scores.csv`) that [`OutputFolder::folder`] has
    /// created.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.stage.join(name)
    }

    /// Where to write the result `name` if it depends on the machine or the time of the run. The manifest lists only
    /// its name, so that repeated runs write the same manifest.
    #[must_use]
    pub fn timed_path(&mut self, name: &str) -> PathBuf {
        self.timed.insert(name.to_owned());
        self.path(name)
    }

    /// Creates the folder `name` for results.
    ///
    /// # Errors
    /// [`OutputError::Folder`] if the folder cannot be created.
    pub fn folder(&self, name: &str) -> Result<PathBuf, OutputError> {
        let path = self.path(name);
        make(&path)?;
        Ok(path)
    }

    /// Replaces the results of the earlier run by the new ones, writes a manifest, and returns the names of the
    /// results, sorted.
    ///
    /// A folder that holds only results and some files changes in one step. Where this is not possible, such as in a
    /// folder that a container mounts, files move one by one: the earlier results are removed, then the new ones move
    /// in. Until the last has moved, the folder is marked as half-made.
    ///
    /// # Errors
    /// [`OutputError`] if a result has the name of a file that no run has written or that has changed since, or the
    /// file system reports an error. The folder then stays unchanged.
    pub fn commit(mut self) -> Result<Vec<String>, OutputError> {
        let names = commit::files_below(&self.stage).map_err(OutputError::write(&self.shown))?;
        let commit = || -> Result<(), OutputError> {
            let manifest = Manifest::of(&self.stage, &names, &self.timed)?;
            manifest.write(&self.stage)?;
            commit::sync_folders(&self.stage).map_err(OutputError::write(&self.shown))?;
            let before = Manifest::read(&self.folder);
            for name in names.iter().map(String::as_str).chain([MANIFEST_FILE]) {
                check_ours(&self.folder, before.as_ref(), name)?;
            }
            Ok(())
        };
        commit().map_err(|error| self.unstaged(error))?;
        let Some(lock) = self.lock.take() else {
            return Ok(names);
        };
        // from here on the stage may hold the results of the run before; the next run sweeps what a signal leaves
        self.entry = None;
        let placed = commit::put_in_place(&self.folder, &self.stage, lock);
        self.lock = placed.lock;
        placed.result.map_err(|error| self.unstaged(error))?;
        self.made.clear();
        Ok(names)
    }

    /// The same error, with the result's final path in place of the path where it waits.
    #[must_use]
    pub fn unstaged(&self, error: OutputError) -> OutputError {
        error.relocated(&|path| self.final_path(path))
    }

    /// Final path of the result that waits at `path`. Any other path is returned unchanged.
    #[must_use]
    pub fn final_path(&self, path: &Path) -> PathBuf {
        let below = path
            .strip_prefix(&self.stage)
            .or_else(|_| path.strip_prefix(&self.folder));
        below.map_or_else(|_| path.to_owned(), |name| self.shown.join(name))
    }

    /// The folder as the user named it.
    #[must_use]
    pub fn shown(&self) -> &Path {
        &self.shown
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // nothing more can be done about what does not go away; the next run in this folder removes it
        let _ = disk::remove_all(&self.stage);
        self.lock = None;
        unmake(&self.made);
    }
}

/// Refuses to replace the file `name` unless an earlier run has written it and it is still as that run wrote it.
fn check_ours(folder: &Path, manifest: Option<&Manifest>, name: &str) -> Result<(), OutputError> {
    let path = folder.join(name);
    // a link or a file in place of one of the name's folders
    let mut parents: Vec<&Path> = Path::new(name).ancestors().skip(1).collect();
    parents.pop();
    for parent in parents {
        let parent = folder.join(parent);
        if parent.symlink_metadata().is_ok_and(|found| !found.is_dir()) {
            return Err(OutputError::NotOurs { path: parent });
        }
    }
    let Ok(found) = path.symlink_metadata() else {
        return Ok(());
    };
    if !found.is_file() && !found.is_symlink() {
        return Err(OutputError::NotRegular { path });
    }
    let Some(manifest) = manifest.filter(|m| name == MANIFEST_FILE || m.names().any(|listed| listed == name)) else {
        return Err(OutputError::NotOurs { path });
    };
    if name == MANIFEST_FILE || manifest.is_unchanged(folder, name).map_err(OutputError::write(&path))? {
        return Ok(());
    }
    Err(OutputError::Changed {
        path,
        manifest: folder.join(MANIFEST_FILE),
        advice: "it is not replaced: move it away or choose another folder",
    })
}

/// Checks that the files `names` of `folder` are those that the last run wrote. It refuses files that have changed, and
/// a folder whose run ended while it moved its results into place. The manifest may lie in `folder` or in one of the
/// two folders above. A folder without a manifest passes.
///
/// # Errors
/// [`OutputError::HalfMade`], [`OutputError::Changed`], or [`OutputError::Write`] for a file that cannot be read.
pub fn check_whole(folder: &Path, names: &[&str]) -> Result<(), OutputError> {
    let Ok(whole) = folder.canonicalize() else {
        return Ok(());
    };
    for above in whole.ancestors().take(3) {
        if disk::exists(&above.join(PLACING)) {
            return Err(OutputError::HalfMade {
                folder: folder.to_owned(),
            });
        }
        let (Some(manifest), Ok(below)) = (Manifest::read(above), whole.strip_prefix(above)) else {
            continue;
        };
        for name in names {
            let listed = below.join(name).to_string_lossy().into_owned();
            if !manifest.names().any(|known| known == listed) {
                continue;
            }
            let path = folder.join(name);
            if !manifest
                .is_unchanged(above, &listed)
                .map_err(OutputError::write(&path))?
            {
                return Err(OutputError::Changed {
                    path,
                    manifest: above.join(MANIFEST_FILE),
                    advice: "the folder holds results of two runs, or the file was changed by hand: then delete the manifest",
                });
            }
        }
        break;
    }
    Ok(())
}

/// Makes the folder `path` and its parents where they are missing; returns those that were made, deepest first.
fn make(path: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let found = path.ancestors().find(|p| p.exists());
    if let Some(found) = found.filter(|found| !found.is_dir()) {
        return Err(OutputError::IsFile { path: found.to_owned() });
    }
    let missing = path
        .ancestors()
        .take_while(|p| Some(*p) != found && *p != Path::new(""));
    let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
    for (k, folder) in missing.iter().enumerate().rev() {
        match disk::make_folder(folder) {
            // another run may make the same parents
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                unmake(&missing[k + 1..]);
                return Err(OutputError::Folder {
                    path: path.to_owned(),
                    source: error,
                });
            }
            _ => {}
        }
    }
    Ok(missing)
}

/// Removes folders that were made for nothing, as far as they are empty.
fn unmake(made: &[PathBuf]) {
    for folder in made {
        let _ = disk::remove_folder(folder);
    }
}

/// Makes the hidden folder in which the results wait.
fn make_stage(folder: &Path) -> io::Result<PathBuf> {
    let made = tempfile::Builder::new()
        .prefix(WAITING)
        .rand_bytes(RANDOM)
        .make_in(folder, disk::make_folder)?;
    Ok(made.into_temp_path().keep()?)
}

/// Whether `name` is one that only this program gives, to what waits or to a lock.
pub(super) fn is_hidden(name: &str) -> bool {
    name.starts_with(WAITING) || name == LOCK_FILE
}
