//! The folder for the results of one run. It is new, empty, or wholly an earlier run's, and changes in one step.
//!
//! The results wait in a hidden folder beside it, `.NAME.spts-new`. At the end the two folders exchange their names in
//! one step (`renameat2` with `RENAME_EXCHANGE`), and the earlier results, which have the hidden name then, are
//! removed. A file system without such a step first gives the earlier results the name `.NAME.spts-old`. A run that is
//! ended leaves what the next run with this folder clears up. A run holds `.NAME.spts-lock` locked.

use super::disk::{self, not_ours, parent, unwritable};
use super::manifest::{MANIFEST_FILE, Manifest, changed};
use crate::cleanup::{Entry, Leftover, listed};
use spts_input::Refusal;
use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::io;
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
    lock: Option<Lock>,
    made: Parents,
}

impl OutputFolder {
    /// Opens the folder `path` for a run. Its parents are created where they are missing.
    ///
    /// # Errors
    /// [`Refusal`] if `path` is a file, holds a file that is not an unchanged result of an earlier run, or cannot
    /// be created or replaced, and while another run is writing to it.
    pub fn open(path: &Path) -> Result<Self, Refusal> {
        let failed = unwritable(path);
        let made = Parents::make(path)?;
        let folder = match path.file_name() {
            // a link to nowhere is no place for a folder
            Some(name) if path.symlink_metadata().is_err() => parent(path).canonicalize().map(|it| it.join(name)),
            _ => path.canonicalize(),
        };
        let folder = folder.map_err(&failed)?;
        let (Some(above), Some(_)) = (folder.parent(), folder.file_name()) else {
            return Err(Refusal::new(UNMOVABLE).at(path.display()));
        };
        let lock = Lock::take(&folder, path)?;
        recover(&folder).map_err(&failed)?;
        check_ours(&folder, path)?;
        if folder.exists() {
            let writable = rustix::fs::access(&folder, rustix::fs::Access::WRITE_OK);
            writable.map_err(|error| failed(error.into()))?;
        }
        let here = std::env::current_dir().and_then(|here| here.canonicalize());
        if here.is_ok_and(|here| here.starts_with(&folder)) || is_mounted(&folder, above) {
            return Err(Refusal::new(UNMOVABLE).at(path.display()));
        }
        let stage = beside(&folder, NEW);
        let make = || disk::make_folder(&stage);
        let ((), entry) = listed(make, |()| Leftover::Folder(stage.clone())).map_err(failed)?;
        Ok(Self {
            folder,
            shown: path.to_owned(),
            stage,
            timed: BTreeSet::new(),
            entry: Some(entry),
            lock: Some(lock),
            made,
        })
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
    /// [`Refusal`] if the folder cannot be created.
    pub fn folder(&self, name: &str) -> Result<PathBuf, Refusal> {
        let path = self.path(name);
        make_folders(&path)?;
        Ok(path)
    }

    /// Replaces the results of the earlier run by the new ones, writes a manifest, and returns the names of the
    /// results, sorted.
    ///
    /// # Errors
    /// [`Refusal`] if a file that is not an unchanged result of an earlier run has come into the folder, or the
    /// file system reports an error. The folder then stays unchanged.
    pub fn commit(mut self) -> Result<Vec<String>, Refusal> {
        let failed = unwritable(&self.shown);
        let names = files_below(&self.stage).map_err(&failed)?;
        let manifest = Manifest::of(&self.stage, &names, &self.timed).and_then(|all| all.write(&self.stage));
        manifest.map_err(|error| self.unstaged(error))?;
        sync_folders(&self.stage).map_err(&failed)?;
        check_ours(&self.folder, &self.shown)?;
        // from here on the stage may be the earlier results, which no signal may remove unseen
        let put = || put_in_place(&self.stage, &self.folder);
        let done = self.entry.take().map_or_else(put, |entry| entry.finish(put));
        done.map_err(failed)?;
        self.stage.clear();
        self.made.keep();
        Ok(names)
    }

    /// The same error, with the result's final path in place of the path where it waits.
    #[must_use]
    pub fn unstaged(&self, error: Refusal) -> Refusal {
        let [from, to] = [&self.stage, &self.shown].map(|folder| folder.join("").display().to_string());
        error.reworded(|message| message.replace(&from, &to))
    }

    /// Final path of the result that waits at `path`. Any other path is returned unchanged.
    #[must_use]
    pub(crate) fn final_path(&self, path: &Path) -> PathBuf {
        let below = path.strip_prefix(&self.stage);
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
        if !self.stage.as_os_str().is_empty() {
            // nothing more can be done about what does not go away; the next run in this folder removes it
            let _ = disk::remove_all(&self.stage);
        }
        // the lock lies in the folders that go after it
        self.lock = None;
    }
}

/// Why a folder that is in use cannot be replaced, as a user is told.
const UNMOVABLE: &str = "is a mount point or the folder that the program works in, so that it cannot be replaced as a \
                         whole; choose a folder in it";

/// Whether something is mounted on `folder`, which lies in `above`.
fn is_mounted(folder: &Path, above: &Path) -> bool {
    use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
    use std::os::unix::fs::MetadataExt as _;
    let found = statx(CWD, folder, AtFlags::empty(), StatxFlags::empty());
    let mounted = found.is_ok_and(|found| found.stx_attributes.contains(StatxAttributes::MOUNT_ROOT));
    let device = |path: &Path| path.metadata().map(|found| found.dev()).ok();
    mounted || device(folder).is_some_and(|of| Some(of) != device(above))
}

/// End of the name of the new results while they wait, and of the earlier ones once they have been exchanged.
const NEW: &str = "new";
/// End of the name of earlier results that have made room for the new ones.
const OLD: &str = "old";

/// Hidden name beside `folder`. Nothing but this program gives such names.
fn beside(folder: &Path, what: &str) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(folder.file_name().unwrap_or_default());
    name.push(".spts-");
    name.push(what);
    folder.with_file_name(name)
}

/// Refuses `folder`, which the user calls `shown`, if it holds a file that is not an unchanged result of an earlier
/// run.
fn check_ours(folder: &Path, shown: &Path) -> Result<(), Refusal> {
    if !disk::exists(folder) {
        return Ok(());
    }
    let manifest = Manifest::read(folder);
    walk(folder, Path::new(""), &mut |name| {
        let path = shown.join(&name);
        let name = name.to_string_lossy();
        match &manifest {
            Some(_) if name == MANIFEST_FILE => Ok(()),
            Some(manifest) if manifest.lists(&name) => {
                if manifest.is_unchanged(folder, &name).map_err(unwritable(&path))? {
                    return Ok(());
                }
                let advice = "it is not replaced: move it away or choose another folder";
                Err(changed(path, shown, advice))
            }
            _ => Err(not_ours(&path)),
        }
    })
}

/// Gives the results in `stage` the name `folder`, which holds nothing but an earlier run's results, and removes those.
fn put_in_place(stage: &Path, folder: &Path) -> io::Result<()> {
    let empty = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_none(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => true,
        Err(error) => return Err(error),
    };
    if let Ok(found) = folder.metadata() {
        std::fs::set_permissions(stage, found.permissions())?;
    }
    // a new name, or that of an empty folder, is taken in one step
    if empty {
        disk::rename(stage, folder)?;
        let _ = disk::sync_folder(parent(folder));
        return Ok(());
    }
    let earlier = match disk::exchange(stage, folder) {
        Ok(()) => stage.to_owned(),
        Err(error) if is_unknown(&error) => {
            let aside = beside(folder, OLD);
            disk::rename(folder, &aside)?;
            if let Err(error) = disk::rename(stage, folder) {
                let shown = aside.display();
                return Err(match disk::rename(&aside, folder) {
                    Ok(()) => error,
                    Err(_) => io::Error::other(format!(
                        "{error}; the earlier results are in {shown}; the next run with this folder puts them back"
                    )),
                });
            }
            aside
        }
        Err(error) => return Err(error),
    };
    // what does not reach the disk or does not go away does no harm: the next run sees to it
    let _ = disk::sync_folder(parent(folder));
    let _ = retire(&earlier, folder);
    Ok(())
}

/// Whether the file system does not know how to exchange two names.
fn is_unknown(error: &io::Error) -> bool {
    use rustix::io::Errno;
    let unknown = [Errno::INVAL, Errno::NOSYS, Errno::OPNOTSUPP];
    unknown
        .iter()
        .any(|one| error.raw_os_error() == Some(one.raw_os_error()))
}

/// Clears up after a run with this `folder` that was ended. The folder is locked, so all of it is of the past.
fn recover(folder: &Path) -> io::Result<()> {
    let [new, old] = [NEW, OLD].map(|what| beside(folder, what));
    let is_folder = |path: &Path| path.symlink_metadata().is_ok_and(|found| found.is_dir());
    if is_folder(&old) {
        match disk::exists(folder) {
            true => retire(&old, folder)?,
            false => disk::rename(&old, folder)?,
        }
    }
    if is_folder(&new) {
        // results have a manifest when they are complete; what is exchanged for them has one, too
        match Manifest::read(&new) {
            Some(_) => retire(&new, folder)?,
            None => disk::remove_all(&new)?,
        }
    }
    Ok(())
}

/// Removes the earlier results in `earlier`. A file that somebody has put there while the run ended moves into
/// `folder`.
fn retire(earlier: &Path, folder: &Path) -> io::Result<()> {
    let manifest = Manifest::read(earlier).unwrap_or_default();
    let mut names = files_below(earlier)?;
    // the manifest last: the next run may have to go on with this
    names.sort_by_key(|name| name == MANIFEST_FILE);
    for name in names {
        let (path, to) = (earlier.join(&name), folder.join(&name));
        if name == MANIFEST_FILE || manifest.is_unchanged(earlier, &name)? {
            disk::remove_file(&path)?;
        } else {
            std::fs::create_dir_all(parent(&to))?;
            let moved = disk::rename_new(&path, &to);
            moved
                .map_err(|error| io::Error::new(error.kind(), format!("{} is in the way: {error}", path.display())))?;
        }
    }
    remove_folders(earlier)
}

/// Removes `folder` and the folders in it, all of them empty.
fn remove_folders(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        remove_folders(&entry?.path())?;
    }
    disk::remove_folder(folder)
}

/// Waits until the entries of `folder` and of the folders in it are on the disk.
fn sync_folders(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_folders(&entry.path())?;
        }
    }
    disk::sync_folder(folder)
}

/// Calls `each` with every file below `folder` in the folder `below` of it, in order of name.
fn walk(folder: &Path, below: &Path, each: &mut dyn FnMut(PathBuf) -> Result<(), Refusal>) -> Result<(), Refusal> {
    let at = folder.join(below);
    let entries = std::fs::read_dir(&at).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let mut entries = entries.map_err(unwritable(&at))?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = below.join(entry.file_name());
        match entry.file_type().map_err(unwritable(&at))?.is_dir() {
            true => walk(folder, &name, each)?,
            false => each(name)?,
        }
    }
    Ok(())
}

/// Names of all files below `folder`, with `/` between their parts, sorted.
fn files_below(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    let walked = walk(folder, Path::new(""), &mut |name| {
        let name = name.into_os_string().into_string();
        names.push(name.map_err(|name| Refusal::new("has a name that is not text").at(name.display()))?);
        Ok(())
    });
    walked.map_err(io::Error::other)?;
    names.sort();
    Ok(names)
}

/// Folders that were created on the way to a folder, deepest first. As far as they are empty, they go when dropped.
#[derive(Debug)]
struct Parents {
    made: Vec<PathBuf>,
    /// Lets a signal remove them.
    _entry: Entry,
}

impl Parents {
    /// Makes the missing parents of `path`.
    fn make(path: &Path) -> Result<Self, Refusal> {
        let made = make_folders(if path.exists() { path } else { parent(path) })?;
        let entry = listed(|| Ok(()), |()| Leftover::EmptyFolders(made.clone())).map_err(unwritable(path));
        Ok(Self { made, _entry: entry?.1 })
    }

    fn keep(&mut self) {
        self.made.clear();
    }
}

impl Drop for Parents {
    fn drop(&mut self) {
        self.made.iter().for_each(|folder| drop(disk::remove_folder(folder)));
    }
}

/// Makes the folder `path` and its parents where they are missing; returns those that were made, deepest first.
fn make_folders(path: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let found = path.ancestors().find(|p| p.exists());
    if let Some(found) = found.filter(|found| !found.is_dir()) {
        return Err(Refusal::new("is a file; the output has to be a folder").at(found.display()));
    }
    let missing = path
        .ancestors()
        .take_while(|p| Some(*p) != found && *p != Path::new(""));
    let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
    for (k, folder) in missing.iter().enumerate().rev() {
        match disk::make_folder(folder) {
            // another run may make the same parents
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                missing[k + 1..].iter().for_each(|made| drop(disk::remove_folder(made)));
                return Err(disk::no_folder(path, error));
            }
            _ => {}
        }
    }
    Ok(missing)
}

/// The lock of a folder, given up when dropped. The operating system holds it (`flock`), not a process number in a
/// file: it holds between containers, and a run that was killed does not hold it.
#[derive(Debug)]
struct Lock {
    _file: File,
    path: PathBuf,
    /// Lets a signal remove the file.
    _entry: Option<Entry>,
}

impl Lock {
    /// Locks `folder`, which the user calls `shown`.
    fn take(folder: &Path, shown: &Path) -> Result<Self, Refusal> {
        let path = beside(folder, LOCK);
        let failed = unwritable(shown);
        loop {
            let file = disk::open_or_create(&path).map_err(|error| match error.kind() {
                io::ErrorKind::PermissionDenied if folder.exists() => {
                    let above = parent(folder).display();
                    let problem = format!("cannot be replaced as a whole: {above}: {error}; choose a folder in it");
                    Refusal::new(problem).at(shown.display())
                }
                _ => failed(error),
            })?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let problem =
                        "another run is writing to this folder; choose another one, or wait until that run has ended";
                    return Err(Refusal::new(problem).at(shown.display()));
                }
                // a file system without locks: one run at a time is then the user's to see to
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(error)) => return Err(failed(error)),
            }
            // the run before may have removed the file between its opening and its locking
            if is_same(&file, &path) {
                let entry = listed(|| Ok(()), |()| Leftover::File(path.clone())).ok();
                return Ok(Self {
                    _file: file,
                    _entry: entry.map(|((), entry)| entry),
                    path,
                });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // while it is still locked, so that no other run holds a file that is gone
        let _ = disk::remove_file(&self.path);
    }
}

/// End of the name of the file that a run holds locked while the folder is its own.
const LOCK: &str = "lock";

/// Whether `file` is what has the name `path`.
fn is_same(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |m: std::fs::Metadata| (m.dev(), m.ino());
    let (held, named) = (file.metadata().map(identity), path.metadata().map(identity));
    matches!((held, named), (Ok(held), Ok(named)) if held == named)
}

#[cfg(test)]
mod tests {
    use super::super::{check_whole, write_bytes, write_npy};
    use super::*;
    use std::fs;

    fn names(dir: &Path) -> Vec<String> {
        let entries = fs::read_dir(dir).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Opens `dir`, writes files with these contents, and commits them.
    fn run(dir: &Path, files: &[(&str, &str)]) -> Result<Vec<String>, Refusal> {
        let out = OutputFolder::open(dir)?;
        for (name, content) in files {
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
        assert_eq!(
            run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap(),
            ["a", "tables/b"]
        );
        let dropped = OutputFolder::open(&out).unwrap();
        write_bytes(&dropped.path("a"), b"half").unwrap();
        drop(dropped);
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
        assert_eq!(
            (names(&out), link.is_symlink()),
            (vec!["d".to_owned(), MANIFEST_FILE.to_owned()], true)
        );
        // a folder that was made for nothing goes again
        drop(OutputFolder::open(&dir.path().join("x/y")).unwrap());
        assert_eq!(names(dir.path()), ["deep", "link"]);
    }

    /// Whatever else lies in a folder is somebody's: it is named, and everything stays.
    #[test]
    fn only_unchanged_results_are_replaced() {
        type Make<'a> = (&'a str, &'a dyn Fn(&Path));
        let make: [Make<'_>; 6] = [
            ("notes.txt", &|out| fs::write(out.join("notes.txt"), "mine").unwrap()),
            ("tables/mine.csv", &|out| {
                fs::write(out.join("tables/mine.csv"), "mine").unwrap()
            }),
            (".hidden/mine", &|out| {
                fs::create_dir(out.join(".hidden")).unwrap();
                fs::write(out.join(".hidden/mine"), "mine").unwrap();
            }),
            ("a", &|out| fs::write(out.join("a"), "mine").unwrap()),
            ("a", &|out| {
                fs::remove_file(out.join("a")).unwrap();
                std::os::unix::fs::symlink("tables/b", out.join("a")).unwrap();
            }),
            // a manifest of somebody's own is nobody's leave to replace what it lists
            ("a", &|out| {
                fs::write(out.join(MANIFEST_FILE), r#"{"format": "mine", "files": {"a": {}}}"#).unwrap();
            }),
        ];
        for (name, make) in make {
            let dir = tempfile::tempdir().unwrap();
            let out = dir.path().join("out");
            run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap();
            let early = OutputFolder::open(&out).unwrap();
            make(&out);
            let shown = out.join(name).display().to_string();
            let late = early.commit().unwrap_err().to_string();
            assert!(late.starts_with(&format!("{shown}: is not ")), "{late}");
            refused(
                &out,
                &[&shown, "is not", "replaced", "move it away or choose another folder"],
            );
            assert_eq!(names(dir.path()), ["out"]);
            assert_eq!(fs::read(out.join("tables/b")).unwrap(), b"old");
        }
    }

    #[test]
    fn one_run_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let first = OutputFolder::open(&out).unwrap();
        write_bytes(&first.path("a"), b"first").unwrap();
        refused(&out, &["out: another run is writing to this folder"]);
        first.commit().unwrap();
        run(&out, &[("a", "second")]).unwrap();
        assert_eq!(fs::read(out.join("a")).unwrap(), b"second");
        assert_eq!(names(dir.path()), ["out"]);
    }

    /// Results of two runs beside each other are noticed, whoever put them there.
    #[test]
    fn mixed_results_are_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        run(&out, &[("a", "one"), ("below/b", "one")]).unwrap();
        check_whole(&out, &["a", "not listed"]).unwrap();
        check_whole(&out.join("below"), &["b"]).unwrap();
        fs::write(out.join("below/b"), "two").unwrap();
        check_whole(&out, &["a"]).unwrap();
        let error = check_whole(&out.join("below"), &["b"]).unwrap_err().to_string();
        assert!(error.contains("below/b") && error.contains(MANIFEST_FILE), "{error}");
    }

    #[test]
    fn what_cannot_be_replaced_as_a_whole_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, b"precious").unwrap();
        refused(&file, &["file: is a file; the output has to be a folder"]);
        refused(&file.join("below"), &["file: is a file"]);
        assert_eq!(fs::read(&file).unwrap(), b"precious");
        let nowhere = dir.path().join("nowhere");
        std::os::unix::fs::symlink(dir.path().join("gone"), &nowhere).unwrap();
        refused(&nowhere, &["nowhere: cannot be written"]);
        assert_eq!(names(dir.path()), ["file", "nowhere"]);
        refused(Path::new("/"), &["/: is a mount point", "choose a folder in it"]);
        assert!(!is_mounted(dir.path(), parent(dir.path())));
        for mounted in ["/proc", "/dev/shm"]
            .map(Path::new)
            .into_iter()
            .filter(|path| path.exists())
        {
            assert!(is_mounted(mounted, parent(mounted)), "{}", mounted.display());
        }
    }

    /// Whatever fails while results wait, the message names where they would have been.
    #[test]
    fn errors_name_the_final_place() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let staged = OutputFolder::open(&out).unwrap();
        write_bytes(&staged.path("figures"), b"in the way").unwrap();
        let in_the_way = staged.folder("figures").unwrap_err();
        let wrong_shape = write_npy(&staged.path("a.npy"), &[4], &[1.0]).unwrap_err();
        for (error, name) in [(in_the_way, "figures"), (wrong_shape, "a.npy")] {
            let text = staged.unstaged(error).to_string();
            assert!(text.starts_with(&format!("{}: ", out.join(name).display())), "{text}");
        }
    }

    /// What lies beside a folder under the hidden names may be anybody's work: only listed results are removed.
    #[test]
    fn what_an_ended_run_has_left_is_read_without_trust() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        run(&at("out"), &[("a", "old")]).unwrap();
        // ended between two renames, in the file system that cannot exchange
        fs::rename(at("out"), at(".out.spts-old")).unwrap();
        drop(OutputFolder::open(&at("out")).unwrap());
        assert_eq!(fs::read(at("out/a")).unwrap(), b"old");
        // a file that came into the earlier results while the run ended goes where it was meant to be
        run(&at("other"), &[("a", "older")]).unwrap();
        fs::create_dir(at("other/mine")).unwrap();
        fs::write(at("other/mine/notes.txt"), "mine").unwrap();
        fs::rename(at("other"), at(".out.spts-new")).unwrap();
        refused(&at("out"), &["out/mine/notes.txt: is not a result"]);
        assert_eq!(fs::read(at("out/mine/notes.txt")).unwrap(), b"mine");
        fs::remove_dir_all(at("out/mine")).unwrap();
        assert_eq!(names(dir.path()), ["out"]);
        // a result that was changed then has a place of its own no more
        fs::create_dir(at(".out.spts-old")).unwrap();
        fs::write(at(".out.spts-old/a"), "mine").unwrap();
        refused(&at("out"), &["out: cannot be written", ".out.spts-old/a is in the way"]);
        assert_eq!(fs::read(at(".out.spts-old/a")).unwrap(), b"mine");
        fs::remove_dir_all(at(".out.spts-old")).unwrap();
        // a link leads to what is not ours, a list may name what is not below, and a pipe never answers
        fs::create_dir(at("precious")).unwrap();
        fs::write(at("precious/a"), "mine").unwrap();
        std::os::unix::fs::symlink(at("precious"), at(".out.spts-new")).unwrap();
        refused(&at("out"), &["out: cannot be written"]);
        fs::remove_file(at(".out.spts-new")).unwrap();
        let list = r#"{"format": "spts-results", "schema": 1, "files": {"../precious/a": {}}}"#;
        fs::create_dir(at(".out.spts-old")).unwrap();
        fs::write(at(".out.spts-old").join(MANIFEST_FILE), list).unwrap();
        drop(OutputFolder::open(&at("out")).unwrap());
        let made = std::process::Command::new("mkfifo").arg(at("out/pipe")).status();
        assert!(made.unwrap().success());
        refused(&at("out"), &["out/pipe: is not a result"]);
        assert_eq!(fs::read(at("precious/a")).unwrap(), b"mine");
    }
}
