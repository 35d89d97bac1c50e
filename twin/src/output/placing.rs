//! Moves results into their folder one by one: the earlier ones are removed first, then the new ones move in.
//!
//! The steps happen in the hidden folder [`PLACING`]. While it exists, the visible folder is half-made, and its
//! contents are enough to restore the earlier results.

use super::commit::files_below;
use super::disk;
use super::error::OutputError;
use super::folder::WAITING;
use super::manifest::{MANIFEST_FILE, is_below};
use std::io;
use std::path::Path;

/// Hidden folder of a folder that is half-made.
pub(super) const PLACING: &str = ".spts-placing";
/// Where the earlier results lie in it.
const OLD: &str = "old";
/// Where the new results lie in it.
const NEW: &str = "new";
/// Names of the new results, a line each, so that the ones that have been moved are known.
const LIST: &str = "list";

/// Largest list that is read, bytes: 100,000 names.
const MAX_LIST_BYTES: u64 = 1 << 24;

/// Puts the results in `stage` in the place of the files `old` of `folder`. After an error everything is as it was, or
/// the folder is marked as half-made where not even that can be done.
pub(super) fn place(folder: &Path, stage: &Path, old: &[String]) -> Result<(), OutputError> {
    let failed = OutputError::write(folder);
    let placing = folder.join(PLACING);
    let random = stage.file_name().unwrap_or_default().to_string_lossy();
    let waiting = folder.join(format!("{WAITING}of{random}"));
    if let Err(error) = prepare(&waiting, stage) {
        let _ = disk::remove_all(&waiting);
        return Err(failed(error));
    }
    let moved = disk::rename_new(&waiting, &placing).and_then(|()| move_files(folder, &placing, old));
    let ended = moved.and_then(|()| disk::rename_new(&placing, &waiting));
    if let Err(error) = ended {
        if disk::exists(&placing) {
            recover(folder).map_err(|_| OutputError::HalfMade {
                folder: folder.to_owned(),
            })?;
        }
        let _ = disk::remove_all(&waiting);
        return Err(failed(error));
    }
    // what does not go away does no harm: the next run removes it
    let _ = disk::remove_all(&waiting);
    Ok(())
}

/// Makes the folder that is to become [`PLACING`], with the new results and their list in it.
fn prepare(waiting: &Path, stage: &Path) -> io::Result<()> {
    disk::make_folder(waiting)?;
    disk::make_folder(&waiting.join(OLD))?;
    let mut list = String::new();
    for name in files_below(stage)? {
        list += &name;
        list.push('\n');
    }
    super::atomic::write_bytes(&waiting.join(LIST), list.as_bytes()).map_err(|error| match error {
        OutputError::Write { source, .. } => source,
        other => io::Error::other(other),
    })?;
    disk::rename_new(stage, &waiting.join(NEW))?;
    disk::sync_folder(waiting)
}

fn move_files(folder: &Path, placing: &Path, old: &[String]) -> io::Result<()> {
    let new = placing.join(NEW);
    // the manifest goes first and comes last: with it in its place, all the others are
    for name in old {
        let to = placing.join(OLD).join(name);
        make_parents(&placing.join(OLD), name)?;
        disk::rename_new(&folder.join(name), &to)?;
    }
    let names = files_below(&new)?;
    for name in names.iter().filter(|name| *name != MANIFEST_FILE) {
        make_parents(folder, name)?;
        disk::rename_new(&new.join(name), &folder.join(name))?;
    }
    disk::rename_new(&new.join(MANIFEST_FILE), &folder.join(MANIFEST_FILE))?;
    // folders of earlier results that are empty now
    remove_empty(folder, old);
    disk::sync_folder(folder)
}

/// Removes the folders of the files `names` below `folder` that are empty.
fn remove_empty(folder: &Path, names: &[String]) {
    for name in names {
        for parent in Path::new(name).ancestors().skip(1).filter(|p| *p != Path::new("")) {
            let _ = disk::remove_folder(&folder.join(parent));
        }
    }
}

/// Makes the folders of the file `name` below `folder`.
fn make_parents(folder: &Path, name: &str) -> io::Result<()> {
    let mut parents: Vec<&Path> = Path::new(name).ancestors().skip(1).collect();
    while let Some(parent) = parents.pop() {
        let path = folder.join(parent);
        if !path.is_dir() {
            disk::make_folder(&path)?;
        }
    }
    Ok(())
}

/// Puts the earlier results of a half-made folder back. May itself be ended at any point and called again.
pub(super) fn recover(folder: &Path) -> io::Result<()> {
    let placing = folder.join(PLACING);
    if !disk::exists(&placing) {
        return Ok(());
    }
    let (new, old) = (placing.join(NEW), placing.join(OLD));
    let list = spts_input::read_text(&placing.join(LIST), MAX_LIST_BYTES)?;
    let names: Vec<String> = list.lines().map(str::to_owned).collect();
    if let Some(name) = names.iter().find(|name| !is_below(name)) {
        let reason = format!("{PLACING}/{LIST} names {name:?}, which is not below the folder");
        return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
    }
    let earlier = files_below(&old)?;
    // a new result that waits no more is in its place
    for name in &names {
        if !disk::exists(&new.join(name)) && disk::exists(&folder.join(name)) {
            make_parents(&new, name)?;
            disk::rename_new(&folder.join(name), &new.join(name))?;
        }
    }
    remove_empty(folder, &names);
    for name in &earlier {
        make_parents(folder, name)?;
        disk::rename_new(&old.join(name), &folder.join(name))?;
    }
    let mut random = tempfile::Builder::new();
    let gone = random
        .prefix(WAITING)
        .make_in(folder, |path| disk::rename_new(&placing, path))?;
    let gone = gone.into_temp_path().keep()?;
    let _ = disk::remove_all(&gone);
    disk::sync_folder(folder)
}
