//! Every disk operation on the way to a result, so that a test can watch each and make it fail, and the refusals of
//! those that fail.

use spts_input::Refusal;
use std::cell::RefCell;
use std::error::Error;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The refusal of a file at `path` that cannot be written, and why.
///
/// ```
/// use spts::output::unwritable;
///
/// let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
/// assert_eq!(unwritable("out/a.csv".as_ref())(full).to_string(), "out/a.csv: cannot be written: no storage space");
/// ```
pub fn unwritable<E: Error + Send + Sync + 'static>(path: &Path) -> impl Fn(E) -> Refusal + use<E> {
    let path = path.to_owned();
    move |source| Refusal::from_error(source).at("cannot be written").at(path.display())
}

/// The refusal of a folder at `path` that cannot be made.
pub fn no_folder(path: &Path, source: io::Error) -> Refusal {
    Refusal::from_error(source)
        .at("the output folder cannot be made")
        .at(path.display())
}

/// The refusal of a file at `path` that has the name of a result, and that no run has written.
#[must_use]
pub fn not_ours(path: &Path) -> Refusal {
    let problem = "is not a result of an earlier run and is not replaced; move it away or choose another folder";
    Refusal::new(problem).at(path.display())
}

/// Kind of a disk operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DiskOperation {
    /// Makes a folder.
    MakeFolder,
    /// Makes an empty file.
    Create,
    /// Writes a piece of a file.
    Write,
    /// Waits until a file or a folder is on the disk.
    Sync,
    /// Gives a file or a folder another name.
    Rename,
    /// Exchanges the names of two folders.
    Exchange,
    /// Removes a file or an empty folder.
    Remove,
}

/// Called before every operation. If it returns an error, the operation fails with that error.
pub type DiskWatcher = Rc<dyn Fn(DiskOperation, &Path) -> io::Result<()>>;

thread_local! {
    static WATCHER: RefCell<Option<DiskWatcher>> = const { RefCell::new(None) };
}

/// Calls `run` while `watcher` observes every disk operation of this thread. Tests use it to see what a full disk or an
/// interrupted run leaves behind.
pub fn watching_disk<T>(watcher: DiskWatcher, run: impl FnOnce() -> T) -> T {
    let before = WATCHER.replace(Some(watcher));
    let result = run();
    WATCHER.set(before);
    result
}

fn tell(operation: DiskOperation, path: &Path) -> io::Result<()> {
    // the watcher may itself write files
    let watcher = WATCHER.with_borrow(Clone::clone);
    watcher.map_or(Ok(()), |watcher| watcher(operation, path))
}

/// A new file whose writes are reported to the watcher. Behind a buffer, one write is one full buffer.
#[derive(Debug)]
pub struct NewFile {
    file: File,
    path: PathBuf,
}

impl NewFile {
    /// Shows other processes that the file is being written, for as long as it is open; where the file system has no
    /// locks they cannot tell.
    pub(super) fn show_in_use(&self) {
        let _ = self.file.try_lock();
    }

    pub(super) fn create(path: &Path) -> io::Result<Self> {
        tell(DiskOperation::Create, path)?;
        Ok(Self {
            file: File::create_new(path)?,
            path: path.to_owned(),
        })
    }

    pub(super) fn sync(&self) -> io::Result<()> {
        tell(DiskOperation::Sync, &self.path)?;
        self.file.sync_all()
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        tell(DiskOperation::Write, &self.path)?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Makes the folder `path`, whose parent exists.
pub(super) fn make_folder(path: &Path) -> io::Result<()> {
    tell(DiskOperation::MakeFolder, path)?;
    std::fs::create_dir(path)
}

/// Opens the file `path` for writing, made where it is missing.
pub(super) fn open_or_create(path: &Path) -> io::Result<File> {
    tell(DiskOperation::Create, path)?;
    File::options().create(true).truncate(false).write(true).open(path)
}

/// Renames `from` to `to`, replacing a file of that name.
pub(super) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    tell(DiskOperation::Rename, to)?;
    std::fs::rename(from, to)
}

/// Renames `from` to `to`, which must not exist.
pub(super) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    tell(DiskOperation::Rename, to)?;
    match renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
        // some file systems do not know the flag
        Err(rustix::io::Errno::INVAL | rustix::io::Errno::NOSYS) if to.symlink_metadata().is_err() => {
            std::fs::rename(from, to)
        }
        other => other.map_err(Into::into),
    }
}

/// Lets the folders `a` and `b` change their names in one step.
pub(super) fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    tell(DiskOperation::Exchange, b)?;
    renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE).map_err(Into::into)
}

/// Waits until the entries of the folder `path` are on the disk.
pub(super) fn sync_folder(path: &Path) -> io::Result<()> {
    tell(DiskOperation::Sync, path)?;
    match File::open(path)?.sync_all() {
        // some network file systems have no such thing for folders
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        other => other,
    }
}

/// Removes the file `path`.
pub(super) fn remove_file(path: &Path) -> io::Result<()> {
    tell(DiskOperation::Remove, path)?;
    std::fs::remove_file(path)
}

/// Removes the empty folder `path`.
pub(super) fn remove_folder(path: &Path) -> io::Result<()> {
    tell(DiskOperation::Remove, path)?;
    std::fs::remove_dir(path)
}

/// Removes the folder `path` and all in it: only for folders whose every file is this program's own.
pub(super) fn remove_all(path: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(path)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            remove_all(&entry.path())?;
        } else {
            remove_file(&entry.path())?;
        }
    }
    remove_folder(path)
}

/// Whether something has the name `path`, a link to nowhere as well.
pub(super) fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Folder of the file `path`.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}
