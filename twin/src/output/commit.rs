//! How the results of a run move into their folder.
//!
//! Two folders exchange their names in one step (`renameat2` with `RENAME_EXCHANGE`), so a reader sees either the
//! earlier results or the new ones. Before that, files that no run has written get a second name in the new folder.
//! Three cases need [`super::placing`] instead: a folder that holds more than files (folders, links) or very many
//! files, a mounted folder, and a file system without such a step.

use super::atomic::parent;
use super::disk;
use super::error::OutputError;
use super::folder::{WAITING, is_hidden};
use super::lock::{LOCK_FILE, Lock};
use super::manifest::{MANIFEST_FILE, Manifest, digest};
use super::placing;
use std::collections::BTreeSet;
use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};

pub(super) use super::placing::{PLACING, recover};

/// Most files of others that get a second name.
const MOST_LINKED: usize = 64;

/// What became of a commit, and the lock of the folder that has its name now.
pub(super) struct Placed {
    pub(super) lock: Option<Lock>,
    pub(super) result: Result<(), OutputError>,
}

/// Puts the results in `stage` in the place of those in `folder`, whose lock is `lock`.
pub(super) fn put_in_place(folder: &Path, stage: &Path, lock: Lock) -> Placed {
    let failed = OutputError::write(folder);
    let old = match earlier(folder) {
        Ok(old) => old,
        Err(error) => {
            return Placed {
                lock: Some(lock),
                result: Err(failed(error)),
            };
        }
    };
    let lock = match exchange(folder, stage, &old, lock) {
        Ok(lock) => {
            return Placed {
                lock: Some(lock),
                result: Ok(()),
            };
        }
        Err(lock) => lock,
    };
    let result = placing::place(folder, stage, &old);
    Placed {
        lock: Some(lock),
        result,
    }
}

/// Files of `folder` that an earlier run has written and nobody has changed, its manifest first.
fn earlier(folder: &Path) -> io::Result<Vec<String>> {
    let Some(manifest) = Manifest::read(folder) else {
        return Ok(Vec::new());
    };
    let mut names = vec![MANIFEST_FILE.to_owned()];
    for name in manifest.names() {
        if manifest.is_unchanged(folder, name)? {
            names.push(name.to_owned());
        }
    }
    Ok(names)
}

/// Exchanges `folder` and `stage`. Gives back the lock of the new folder, or where that cannot be the lock of the old
/// one, with everything as it was.
fn exchange(folder: &Path, stage: &Path, old: &[String], lock: Lock) -> Result<Lock, Lock> {
    let Some((beside, others)) = can_exchange(folder, stage, old) else {
        return Err(lock);
    };
    let Some(linked) = link(folder, stage, &others) else {
        return Err(lock);
    };
    match exchange_linked(folder, stage, &beside) {
        Some(new_lock) => {
            lock.leave();
            // what does not reach the disk or does not go away does no harm: the next run sees to it
            let _ = disk::sync_folder(&parent(folder));
            let _ = retire(&beside, folder);
            Ok(new_lock)
        }
        None => {
            linked.iter().for_each(|path| drop(disk::remove_file(path)));
            Err(lock)
        }
    }
}

/// Where the new results are to wait beside `folder`, and the files of others that belong to them. Nothing where files
/// have to move one by one.
fn can_exchange(folder: &Path, stage: &Path, old: &[String]) -> Option<(PathBuf, Vec<String>)> {
    // the folder that a shell or a notebook works in should stay the same folder
    let here = std::env::current_dir().and_then(|dir| dir.canonicalize()).ok()?;
    if here.starts_with(folder) {
        return None;
    }
    let beside = folder.parent()?.join(name_beside(folder, stage)?);
    std::fs::set_permissions(stage, folder.metadata().ok()?.permissions()).ok()?;
    Some((beside, others(folder, stage, old)?))
}

/// Moves `stage` to `beside` and exchanges it with `folder`; gives the lock of what `folder` is then. Nothing when one
/// of the steps cannot be made; what was done is undone then.
fn exchange_linked(folder: &Path, stage: &Path, beside: &Path) -> Option<Lock> {
    // locked before it has its name, so that no other run comes in between
    let lock = Lock::take(stage).ok()?;
    disk::rename_new(stage, beside).ok()?;
    let lock = lock.moved_to(beside);
    if disk::exchange(beside, folder).is_err() {
        drop(lock);
        let _ = disk::rename_new(beside, stage);
        return None;
    }
    Some(lock.moved_to(folder))
}

/// Name beside `folder` of what takes part in the exchange; it has the random letters of `stage`.
fn name_beside(folder: &Path, stage: &Path) -> Option<String> {
    let (folder, stage) = (folder.file_name()?.to_str()?, stage.file_name()?.to_str()?);
    Some(format!(".{folder}{stage}"))
}

/// Files of `folder` that are not of the earlier run, by their names; nothing when there are more than get a second
/// name, or what is not a file.
fn others(folder: &Path, stage: &Path, old: &[String]) -> Option<Vec<String>> {
    let old: BTreeSet<&str> = old.iter().map(String::as_str).collect();
    let known: BTreeSet<PathBuf> = old.iter().map(|name| folder.join(name)).collect();
    let folders: BTreeSet<&Path> = known.iter().flat_map(|path| path.ancestors().skip(1)).collect();
    let (mut others, mut ahead) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(below) = ahead.pop() {
        for entry in std::fs::read_dir(folder.join(&below)).ok()? {
            let entry = entry.ok()?;
            let (name, kind) = (below.join(entry.file_name()), entry.file_type().ok()?);
            let path = folder.join(&name);
            if path == stage || name == Path::new(LOCK_FILE) || known.contains(&path) {
            } else if kind.is_file() && others.len() < MOST_LINKED {
                others.push(name.to_str()?.to_owned());
            } else if kind.is_dir() && folders.contains(path.as_path()) {
                ahead.push(name);
            } else {
                return None;
            }
        }
    }
    Some(others)
}

/// Gives the files `names` of `folder` a second name each below `stage`. Nothing when one of them gets none; those that
/// got one lose it again then.
fn link(folder: &Path, stage: &Path, names: &[String]) -> Option<Vec<PathBuf>> {
    let mut linked = Vec::new();
    for name in names {
        let to = stage.join(name);
        let parent = to.parent()?;
        let made = std::fs::create_dir_all(parent).and_then(|()| disk::link(&folder.join(name), &to));
        if made.is_err() {
            linked.iter().for_each(|path: &PathBuf| drop(disk::remove_file(path)));
            return None;
        }
        linked.push(to);
    }
    Some(linked)
}

/// Removes what runs that were killed have left waiting in `folder` and beside it. The folder is locked, so all of it
/// is of the past.
pub(super) fn sweep(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(WAITING)) {
            let _ = match entry.file_type()?.is_dir() {
                true => disk::remove_all(&entry.path()),
                false => disk::remove_file(&entry.path()),
            };
        }
    }
    let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) else {
        return Ok(());
    };
    let start = format!(".{}{WAITING}", name.to_string_lossy());
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(&start) {
            let _ = retire(&entry.path(), folder);
        }
    }
    Ok(())
}

/// Takes the folder `beside` apart, which took part in an exchange with `folder`: results go, and a file of others that
/// came in the meantime moves into `folder`. What cannot move stays.
fn retire(beside: &Path, folder: &Path) -> io::Result<()> {
    let manifest = Manifest::read(beside).unwrap_or_default();
    let mut names = files_below(beside)?;
    // the manifest last: the next run may have to go on with this
    names.sort_by_key(|name| name == MANIFEST_FILE);
    for name in names {
        let (path, new) = (beside.join(&name), folder.join(&name));
        let known = name == MANIFEST_FILE || manifest.is_unchanged(beside, &name)?;
        if known || is_same(&path, &new) || is_alike(&path, &new) {
            disk::remove_file(&path)?;
        } else if new.parent().is_some_and(Path::is_dir) {
            disk::rename_new(&path, &new)?;
        }
    }
    remove_folders(beside)
}

/// Removes `folder` and the folders in it as far as they are empty, and hidden ones whatever is in them.
fn remove_folders(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let hidden = is_hidden(&entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true if hidden => disk::remove_all(&entry.path())?,
            true => remove_folders(&entry.path())?,
            false if hidden => disk::remove_file(&entry.path())?,
            false => {}
        }
    }
    disk::remove_folder(folder)
}

/// Whether both are names of the same file.
fn is_same(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |path: &Path| path.symlink_metadata().map(|m| (m.dev(), m.ino())).ok();
    identity(a).is_some_and(|a| Some(a) == identity(b))
}

/// Whether both have the same content.
fn is_alike(a: &Path, b: &Path) -> bool {
    let content = |path: &Path| {
        path.symlink_metadata().ok().filter(Metadata::is_file)?;
        digest(path).ok()
    };
    content(a).is_some_and(|a| Some(a) == content(b))
}

/// Waits until the entries of `folder` and of the folders in it are on the disk.
pub(super) fn sync_folders(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_folders(&entry.path())?;
        }
    }
    disk::sync_folder(folder)
}

/// Names of all files below `folder` but those that wait or lock it, with `/` between their parts, sorted.
pub(super) fn files_below(folder: &Path) -> io::Result<Vec<String>> {
    let (mut names, mut ahead) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(below) = ahead.pop() {
        for entry in std::fs::read_dir(folder.join(&below))? {
            let entry = entry?;
            let name = below.join(entry.file_name());
            if is_hidden(&entry.file_name().to_string_lossy()) {
                continue;
            }
            if entry.file_type()?.is_dir() {
                ahead.push(name);
            } else {
                let name = name.into_os_string().into_string();
                names.push(name.map_err(|_| io::Error::from(io::ErrorKind::InvalidFilename))?);
            }
        }
    }
    names.sort();
    Ok(names)
}
