//! The folder for the results of one run. It is new, empty, or wholly an earlier run's, and changes in one step.
//!
//! The results wait in a hidden folder beside it, `.NAME.spts-new`. At the end the two folders exchange their names in
//! one step (`renameat2` with `RENAME_EXCHANGE`), and the earlier results, which have the hidden name then, are
//! removed. A file system without such a step first gives the earlier results the name `.NAME.spts-old`. A run that is
//! ended leaves what the next run with this folder clears up. A run holds `.NAME.spts-lock` locked.

use super::disk::{self, Below, DiskOperation, no_folder, not_ours, parent, unwritable, watched};
use super::manifest::{MANIFEST_FILE, Manifest, changed};
use crate::cleanup::{Entry, Leftover, listed};
use spts_input::Refusal;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{File, Metadata, TryLockError};
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// A folder that a run is filling. From its opening on, no other run can open it. The results wait beside it until
/// [`OutputFolder::commit`]. Without a commit the folder stays unchanged.
#[derive(Debug)]
pub struct OutputFolder {
    /// The folder without symbolic links, because the exchange must act on the folder itself.
    folder: PathBuf,
    /// The folder as the user named it.
    shown: PathBuf,
    stage: PathBuf,
    timed: BTreeSet<String>,
    /// Lets a signal remove the waiting results; `None` once they are in place.
    entry: Option<Entry>,
    _lock: Lock,
}

impl OutputFolder {
    /// Opens the folder `path` for a run. Its parents are created where they are missing.
    ///
    /// # Errors
    /// [`Refusal`] if `path` is a file, holds a file that is not an unchanged result of an earlier run, or cannot
    /// be created or replaced, and while another run is writing to it.
    pub fn open(path: &Path) -> Result<Self, Refusal> {
        let failed = unwritable(path);
        let missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let made = path.ancestors().skip(1).take_while(missing);
        let made: Vec<PathBuf> = made.map(Path::to_owned).collect();
        make_folders(if path.exists() { path } else { parent(path) })?;
        let folder = match path.file_name() {
            // a link to nowhere is no place for a folder
            Some(name) if !disk::exists(path) => parent(path).canonicalize().map(|above| above.join(name)),
            _ => path.canonicalize(),
        };
        let folder = folder.map_err(&failed)?;
        if is_unmovable(&folder) {
            let problem = "is a mount point or the folder that the program works in, so that it cannot be replaced as \
                           a whole; choose a folder in it";
            return Err(Refusal::new(problem).at(path.display()));
        }
        let lock = Lock::take(&folder, path, made)?;
        recover(&folder, path)?;
        check_ours(&folder, path)?;
        if folder.exists() {
            let writable = rustix::fs::access(&folder, rustix::fs::Access::WRITE_OK);
            writable.map_err(|error| failed(error.into()))?;
        }
        let stage = beside(&folder, "new");
        let make = || watched(DiskOperation::Other, &stage, || std::fs::create_dir(&stage));
        let ((), entry) = listed(make, |()| Leftover::Folder(stage.clone())).map_err(failed)?;
        Ok(Self { folder, shown: path.to_owned(), stage, timed: BTreeSet::new(), entry: Some(entry), _lock: lock })
    }

    /// Where to write the result `name`. It may lie in a folder (`tables/scores.csv`) that [`OutputFolder::folder`] has
    /// created.
    pub fn path(&self, name: &str) -> PathBuf {
        self.stage.join(name)
    }

    /// Where to write the result `name` if it depends on the machine or the time of the run. The manifest lists only
    /// its name, so that repeated runs write the same manifest.
    pub fn timed_path(&mut self, name: &str) -> PathBuf {
        self.timed.insert(name.to_owned());
        self.path(name)
    }

    /// Creates the folder `name` for results.
    ///
    /// # Errors
    /// [`Refusal`] if the folder cannot be created.
    pub fn folder(&self, name: &str) -> Result<PathBuf, Refusal> {
        let path = self.path(name);
        make_folders(&path).map(|()| path)
    }

    /// Replaces the results of the earlier run by the new ones, writes a manifest, and returns the names of the
    /// results, sorted.
    ///
    /// # Errors
    /// [`Refusal`] if a file that is not an unchanged result of an earlier run has come into the folder, or the
    /// file system reports an error. The folder then stays unchanged.
    pub fn commit(mut self) -> Result<Vec<String>, Refusal> {
        let failed = unwritable(&self.shown);
        let (files, folders) = disk::below(&self.stage).map_err(&failed)?;
        let names: Vec<String> = files.iter().map(|name| name.display().to_string()).collect();
        let manifest = Manifest::write_of(&self.stage, &names, &self.timed);
        manifest.map_err(|error| self.unstaged(error))?;
        let synced = folders.iter().try_for_each(|folder| disk::sync_folder(&self.stage.join(folder)));
        synced.map_err(&failed)?;
        check_ours(&self.folder, &self.shown)?;
        // from here on the stage may be the earlier results, which no signal may remove unseen
        let put = || put_in_place(&self.stage, &self.folder);
        let done = self.entry.take().map_or_else(put, |entry| entry.finish(put));
        done.map_err(failed)?;
        self.stage.clear();
        Ok(names)
    }

    /// The same error, with the result's final path in place of the path where it waits.
    pub fn unstaged(&self, error: Refusal) -> Refusal {
        let [from, to] = [&self.stage, &self.shown].map(|folder| folder.join("").display().to_string());
        error.reworded(|message| message.replace(&from, &to))
    }

    /// The folder as the user named it.
    pub fn shown(&self) -> &Path {
        &self.shown
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.stage.as_os_str().is_empty() {
            // nothing more can be done about what does not go away; the next run in this folder removes it
            let _ = disk::below(&self.stage).and_then(|found| disk::remove_all(&self.stage, &found));
        }
    }
}

/// Whether `folder` is in use: something is mounted on it, or the program works in it.
fn is_unmovable(folder: &Path) -> bool {
    let device = |path: &Path| path.metadata().ok().map(|found| found.dev());
    // not every system tells of a mount; another device does
    let mounted =
        is_mount_root(folder) || device(folder).is_some_and(|of| folder.parent().and_then(device) != Some(of));
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    mounted || here.is_ok_and(|here| here.starts_with(folder))
}

/// Whether the system says that something is mounted on `folder`.
#[cfg(target_os = "linux")]
fn is_mount_root(folder: &Path) -> bool {
    use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
    let found = statx(CWD, folder, AtFlags::empty(), StatxFlags::empty());
    found.is_ok_and(|found| found.stx_attributes.contains(StatxAttributes::MOUNT_ROOT))
}

#[cfg(not(target_os = "linux"))]
fn is_mount_root(_: &Path) -> bool {
    false
}

/// Hidden name beside `folder`. Nothing but this program gives such names.
fn beside(folder: &Path, what: &str) -> PathBuf {
    let name = folder.file_name().unwrap_or_default();
    let parts = [OsStr::new("."), name, OsStr::new(".spts-"), OsStr::new(what)];
    folder.with_file_name(parts.join(OsStr::new("")))
}

/// Refuses `folder`, which the user calls `shown`, if it holds a file that is not an unchanged result of an earlier
/// run. Returns what is in it.
fn check_ours(folder: &Path, shown: &Path) -> Result<Below, Refusal> {
    if !disk::exists(folder) {
        return Ok(Below::default());
    }
    let (manifest, found) = (Manifest::read(folder), disk::below(folder).map_err(unwritable(shown))?);
    for file in &found.0 {
        let (path, name) = (shown.join(file), file.to_string_lossy());
        match &manifest {
            Some(_) if name == MANIFEST_FILE => {}
            Some(all) if all.is_unchanged(folder, &name).map_err(unwritable(&path))? => {}
            Some(all) if all.lists(&name) => {
                let advice = "it is not replaced: move it away or choose another folder";
                return Err(changed(&path, shown, advice));
            }
            _ => return Err(not_ours(&path)),
        }
    }
    Ok(found)
}

/// Removes `folder`, which holds nothing but an earlier run's results.
fn discard(folder: &Path) -> Result<(), Refusal> {
    disk::remove_all(folder, &check_ours(folder, folder)?).map_err(unwritable(folder))
}

/// Gives the results in `stage` the name `folder`, which holds nothing but an earlier run's results, and removes those.
fn put_in_place(stage: &Path, folder: &Path) -> io::Result<()> {
    if let Ok(found) = folder.metadata() {
        std::fs::set_permissions(stage, found.permissions())?;
    }
    // a new name, or that of an empty folder, is taken in one step
    match disk::rename(stage, folder) {
        Err(error) if matches!(error.kind(), ErrorKind::DirectoryNotEmpty | ErrorKind::AlreadyExists) => {
            exchange(stage, folder)?;
        }
        other => other?,
    }
    // what does not reach the disk or does not go away does no harm: the next run sees to it
    let _ = disk::sync_folder(parent(folder));
    let _ = discard(stage);
    Ok(())
}

/// Lets the results in `stage` and those in `folder` change their names.
fn exchange(stage: &Path, folder: &Path) -> io::Result<()> {
    if disk::exchange(stage, folder)? {
        return Ok(());
    }
    let aside = beside(folder, "old");
    disk::rename(folder, &aside)?;
    if let Err(error) = disk::rename(stage, folder) {
        let shown = aside.display();
        let left = format!("{error}; the earlier results are in {shown}; the next run with this folder puts them back");
        let back = disk::rename(&aside, folder);
        return Err(if back.is_ok() { error } else { io::Error::other(left) });
    }
    // the next run does it otherwise
    let _ = disk::rename(&aside, stage);
    Ok(())
}

/// Clears up after a run with this `folder` that was ended. The folder is locked, so all of it is of the past.
fn recover(folder: &Path, shown: &Path) -> Result<(), Refusal> {
    let [new, old] = ["new", "old"].map(|what| beside(folder, what));
    let is_folder = |path: &Path| path.symlink_metadata().is_ok_and(|found| found.is_dir());
    if is_folder(&old) {
        let to = if disk::exists(folder) { &new } else { folder };
        if to == new {
            check_ours(&old, &old)?;
        }
        disk::rename(&old, to).map_err(unwritable(shown))?;
    }
    match Manifest::read(&new) {
        _ if !is_folder(&new) => Ok(()),
        Some(_) => discard(&new),
        // results that are not complete, or of which some have been removed
        None => {
            let removed = disk::below(&new).and_then(|found| disk::remove_all(&new, &found));
            removed.map_err(unwritable(shown))
        }
    }
}

/// Makes the folder `path` and its parents where they are missing.
fn make_folders(path: &Path) -> Result<(), Refusal> {
    if let Some(found) = path.ancestors().find(|p| p.exists()).filter(|found| !found.is_dir()) {
        return Err(Refusal::new("is a file; the output has to be a folder").at(found.display()));
    }
    let made = watched(DiskOperation::Other, path, || std::fs::create_dir_all(path));
    made.map_err(|error| no_folder(path, error))
}

/// The lock of a folder, given up when dropped. The operating system holds it (`flock`), not a process number in a
/// file: it holds between containers, and a run that was killed does not hold it.
#[derive(Debug)]
struct Lock {
    _file: File,
    /// The file, and the folders that were made on the way to it, deepest first. They go if nothing else is in them.
    left: Vec<PathBuf>,
    /// Lets a signal remove them.
    _entry: Entry,
}

impl Lock {
    /// Locks `folder`, which the user calls `shown`, and for which the parents `made` were made.
    fn take(folder: &Path, shown: &Path, made: Vec<PathBuf>) -> Result<Self, Refusal> {
        let path = beside(folder, "lock");
        let failed = unwritable(shown);
        let open = || File::options().create(true).truncate(false).write(true).open(&path);
        loop {
            let file = watched(DiskOperation::Other, &path, open).map_err(|error| {
                let above = parent(folder).display();
                let problem = format!("cannot be replaced as a whole: {above}: {error}; choose a folder in it");
                let denied = error.kind() == ErrorKind::PermissionDenied && folder.exists();
                if denied { Refusal::new(problem).at(shown.display()) } else { failed(error) }
            })?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    let problem =
                        "another run is writing to this folder; choose another one, or wait until that run has ended";
                    return Err(Refusal::new(problem).at(shown.display()));
                }
                Err(TryLockError::Error(error)) if error.kind() != ErrorKind::Unsupported => return Err(failed(error)),
                // a file system without locks: one run at a time is then the user's to see to
                _ => {}
            }
            // the run before may have removed the file between its opening and its locking
            let identity = |found: io::Result<Metadata>| found.ok().map(|found| (found.dev(), found.ino()));
            if identity(file.metadata()) == identity(path.metadata()) {
                let left = [vec![path], made].concat();
                let entry = listed(|| Ok(()), |()| Leftover::Each(left.clone())).map_err(failed)?;
                return Ok(Self { _file: file, left, _entry: entry.1 });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // while it is still locked, so that no other run holds a file that is gone
        self.left.iter().for_each(|path| drop(disk::remove(path)));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{check_whole, watching_disk, write_bytes, write_npy};
    use super::*;
    use std::cell::Cell;
    use std::collections::BTreeMap;
    use std::fs;
    use std::rc::Rc;

    /// Names and contents of the results of a run.
    type Results<'a> = &'a [(&'a str, &'a str)];

    fn names(dir: &Path) -> Vec<String> {
        let entries = fs::read_dir(dir).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// All files below `dir`, which may be missing.
    fn there(dir: &Path) -> BTreeMap<PathBuf, String> {
        let (files, _) = disk::below(dir).unwrap_or_default();
        let read = |name: PathBuf| (name.clone(), fs::read_to_string(dir.join(name)).unwrap());
        files.into_iter().map(read).collect()
    }

    /// Writes `content` as the file `path`, in a folder that may be missing.
    fn put(path: &Path, content: &str) {
        fs::create_dir_all(parent(path)).unwrap();
        fs::write(path, content).unwrap();
    }

    fn run(dir: &Path, results: Results<'_>) -> Result<Vec<String>, Refusal> {
        let out = OutputFolder::open(dir)?;
        for (name, content) in results {
            if let Some((folder, _)) = name.rsplit_once('/') {
                out.folder(folder)?;
            }
            write_bytes(&out.path(name), content.as_bytes())?;
        }
        out.commit()
    }

    #[track_caller]
    fn refused(dir: &Path, facts: &[&str]) {
        let said = OutputFolder::open(dir).unwrap_err().to_string();
        for fact in facts {
            assert!(said.contains(fact), "{fact:?} is not in {said}");
        }
    }

    #[test]
    fn results_of_a_run_appear_together_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("deep/er");
        assert_eq!(run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap(), ["a", "tables/b"]);
        let first = OutputFolder::open(&out).unwrap();
        refused(&out, &["deep/er: another run is writing to this folder"]);
        // whatever fails while results wait, the message names where they would have been
        write_bytes(&first.path("figures"), b"half").unwrap();
        let in_the_way = first.folder("figures").unwrap_err();
        let wrong_shape = write_npy(&first.path("a.npy"), &[4], &[1.0]).unwrap_err();
        for (error, name) in [(in_the_way, "figures"), (wrong_shape, "a.npy")] {
            let text = first.unstaged(error).to_string();
            assert!(text.starts_with(&format!("{}: ", out.join(name).display())), "{text}");
        }
        drop(first);
        assert_eq!(fs::read(out.join("a")).unwrap(), b"old");
        // an empty folder and a result that is gone are nobody's loss
        fs::create_dir(out.join("empty")).unwrap();
        fs::remove_file(out.join("tables/b")).unwrap();
        run(&out, &[("a", "new"), ("c", "new")]).unwrap();
        assert_eq!(fs::read(out.join("a")).unwrap(), b"new");
        // what the earlier run has left would stand beside the new results
        assert_eq!(names(&out), ["a", "c", MANIFEST_FILE]);
        assert_eq!(names(&dir.path().join("deep")), ["er"]);
        // the folder that a link names is replaced, and not the link
        let link = dir.path().join("link");
        std::os::unix::fs::symlink(&out, &link).unwrap();
        run(&link, &[("d", "new")]).unwrap();
        assert!(names(&out) == ["d", MANIFEST_FILE] && link.is_symlink());
        // a folder that was made for nothing goes again
        drop(OutputFolder::open(&dir.path().join("x/y")).unwrap());
        assert_eq!(names(dir.path()), ["deep", "link"]);
    }

    /// Whatever else lies in a folder is somebody's: it is named, and everything stays.
    #[test]
    fn only_unchanged_results_are_replaced() {
        // a manifest of somebody's own is nobody's leave to replace what it lists
        let mine = r#"{"format": "mine", "files": {"a": {}}}"#;
        for put_there in ["notes.txt", "tables/mine.csv", ".hidden/mine", "a", "link", MANIFEST_FILE] {
            let of_a = ["link", MANIFEST_FILE].contains(&put_there);
            let dir = tempfile::tempdir().unwrap();
            let out = dir.path().join("out");
            run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap();
            let early = OutputFolder::open(&out).unwrap();
            if put_there == "link" {
                fs::remove_file(out.join("a")).unwrap();
                std::os::unix::fs::symlink("tables/b", out.join("a")).unwrap();
            } else {
                put(&out.join(put_there), mine);
            }
            let shown = out.join(if of_a { "a" } else { put_there }).display().to_string();
            let late = early.commit().unwrap_err().to_string();
            assert!(late.starts_with(&format!("{shown}: is not ")), "{late}");
            refused(&out, &[&shown, "replaced", "move it away or choose another folder"]);
            assert_eq!(names(dir.path()), ["out"]);
            assert_eq!(fs::read(out.join("tables/b")).unwrap(), b"old");
        }
    }

    /// Results of two runs beside each other are noticed, whoever put them there.
    #[test]
    fn mixed_results_are_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        run(&out, &[("a", "one"), ("below/b", "one")]).unwrap();
        check_whole(&out.join("below"), &["b", "not listed"]).unwrap();
        put(&out.join("below/b"), "two");
        check_whole(&out, &["a"]).unwrap();
        let error = check_whole(&out.join("below"), &["b"]).unwrap_err().to_string();
        assert!(error.contains("below/b") && error.contains(MANIFEST_FILE), "{error}");
    }

    #[test]
    fn what_cannot_be_replaced_as_a_whole_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let nowhere = dir.path().join("nowhere");
        std::os::unix::fs::symlink("gone", &nowhere).unwrap();
        refused(&nowhere, &["nowhere: cannot be written"]);
        assert_eq!(names(dir.path()), ["nowhere"]);
        refused(Path::new("/proc"), &["/proc: is a mount point", "choose a folder in it"]);
    }

    /// What lies beside a folder under the hidden names may be anybody's work: only listed results are removed.
    #[test]
    fn what_an_ended_run_has_left_is_read_without_trust() {
        let dir = tempfile::tempdir().unwrap();
        let [out, new, old, precious] =
            ["out", ".out.spts-new", ".out.spts-old", "precious"].map(|name| dir.path().join(name));
        run(&out, &[("a", "old")]).unwrap();
        for left in [&new, &old] {
            run(left, &[("a", "older")]).unwrap();
            put(&left.join("mine/notes.txt"), "mine");
            refused(&out, &["mine/notes.txt: is not a result", left.to_str().unwrap()]);
            assert_eq!(fs::read(left.join("mine/notes.txt")).unwrap(), b"mine");
            fs::remove_dir_all(left.join("mine")).unwrap();
            drop(OutputFolder::open(&out).unwrap());
            assert_eq!(names(dir.path()), ["out"]);
        }
        // a link leads to what is not ours, a list may name what is not below, and a socket never answers
        put(&precious.join("a"), "mine");
        std::os::unix::fs::symlink(&precious, &new).unwrap();
        refused(&out, &["out: cannot be written"]);
        fs::remove_file(&new).unwrap();
        let list = r#"{"format": "spts-results", "schema": 1, "files": {"../precious/a": {}}}"#;
        put(&old.join(MANIFEST_FILE), list);
        refused(&out, &[".out.spts-old/manifest.json: is not a result"]);
        fs::remove_dir_all(&old).unwrap();
        std::os::unix::net::UnixListener::bind(out.join("pipe")).unwrap();
        refused(&out, &["out/pipe: is not a result"]);
        assert_eq!(fs::read(precious.join("a")).unwrap(), b"mine");
    }

    fn copy(from: &Path, to: &Path) {
        let (files, folders) = disk::below(from).unwrap();
        folders.iter().for_each(|name| fs::create_dir_all(to.join(name)).unwrap());
        for name in files {
            fs::copy(from.join(&name), to.join(name)).unwrap();
        }
    }

    /// Puts `new` in place of `old`, of which nothing is there where it is empty, and which lies `away` where a run was
    /// ended between two renames. Every operation on the disk fails once, as when a network folder is away for a
    /// moment; fails like all that follow, as on a full disk; and is the one before which the run is killed.
    fn check_every_step(old: Results<'_>, away: bool, exchanges: bool) {
        const INVALID: i32 = 22;
        let new: Results<'_> = &[("a", "new"), ("same", "same"), ("tables/csv/c", "new")];
        // where the disk does not slow the operations down, if there is such a place
        let dir = tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap());
        let base = dir.path().join("base");
        fs::create_dir(&base).unwrap();
        if !old.is_empty() {
            run(&base.join("out"), old).unwrap();
        }
        let before = there(&base.join("out"));
        if away {
            fs::rename(base.join("out"), base.join(".out.spts-old")).unwrap();
        }
        // the result, what is left, and the number of operations
        let attempt = |name: &str, step: usize, fault: &'static str| {
            let [left, killed] = ["run", "killed"].map(|of| dir.path().join(format!("{of} {name}")));
            copy(&base, &left);
            let (out, from, to) = (left.join("out"), left.clone(), killed.clone());
            let count = Rc::new(Cell::new(0));
            let at = Rc::clone(&count);
            let watcher = move |operation, _: &Path| {
                let now = at.replace(at.get() + 1);
                match fault {
                    "killed" if now == step => copy(&from, &to),
                    "once" if now == step => return Err(ErrorKind::StorageFull.into()),
                    "from then" if now >= step => return Err(ErrorKind::StorageFull.into()),
                    _ => {}
                }
                // a file system that cannot exchange says so
                let unknown = operation == DiskOperation::Exchange && !exchanges;
                if unknown { Err(io::Error::from_raw_os_error(INVALID)) } else { Ok(()) }
            };
            let result = watching_disk(watcher, || run(&out, new));
            (result, if fault == "killed" { killed } else { left }, count.get())
        };
        let (result, left, steps) = attempt("whole", usize::MAX, "once");
        result.unwrap();
        let after = there(&left.join("out"));
        assert!(before != after && steps > 20, "{steps} steps");
        let mut seen = [0; 3];
        for (step, fault) in (0..steps).flat_map(|step| ["once", "from then", "killed"].map(|fault| (step, fault))) {
            let (result, left, _) = attempt(&format!("{step} {fault}"), step, fault);
            let (what, out) = (format!("{step}, {fault}: {result:?}"), left.join("out"));
            // between two renames there is no folder, never half of one
            let is_aside = (away || !exchanges) && !out.exists() && there(&left.join(".out.spts-old")) == before;
            let states = [there(&out) == before, there(&out) == after, is_aside];
            let state = states.iter().position(|is| *is).unwrap_or_else(|| panic!("{what}: a mixture"));
            seen[state] += 1;
            match (fault, result.is_ok()) {
                ("once", false) => assert!(state == 0 || away && state == 2, "{what}"),
                ("once" | "from then", true) => assert_eq!(state, 1, "{what}"),
                _ => {}
            }
            // a run that writes nothing puts back what was away, and the next one leaves nothing of this one
            drop(OutputFolder::open(&out).unwrap());
            assert!([&before, &after].contains(&&there(&out)), "{what}: not put back");
            run(&out, new).unwrap();
            assert!(there(&out) == after && names(&left) == ["out"], "{what}: {:?}", names(&left));
        }
        eprintln!("{steps} steps, each with three faults: {seen:?} times earlier, new, and aside and put back");
    }

    #[test]
    fn a_run_fails_or_is_killed_at_every_step() {
        let old: Results<'_> = &[("a", "old"), ("same", "same"), ("arrays/b", "old")];
        check_every_step(old, false, true);
        check_every_step(old, false, false);
        check_every_step(old, true, true);
        check_every_step(&[], false, true);
    }
}
