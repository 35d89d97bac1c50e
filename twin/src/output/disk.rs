//! Every disk operation on the way to a result, so that a test can watch each and make it fail, and the refusals of
//! those that fail.

use spts_input::Refusal;
use std::cell::RefCell;
use std::error::Error;
use std::fs::File;
use std::io::{self, Seek as _, SeekFrom, Write};
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
    Refusal::from_error(source).at("the output folder cannot be made").at(path.display())
}

/// The refusal of a file at `path` that has the name of a result, and that no run has written.
pub fn not_ours(path: &Path) -> Refusal {
    let problem = "is not a result of an earlier run and is not replaced; move it away or choose another folder";
    Refusal::new(problem).at(path.display())
}

/// Kind of a disk operation, as far as a watcher answers to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DiskOperation {
    /// Exchanges the names of two folders.
    Exchange,
    /// Removes a file or an empty folder.
    Remove,
    /// Makes, writes, renames, or waits until something is on the disk.
    Other,
}

type Watcher = Rc<dyn Fn(DiskOperation, &Path) -> io::Result<()>>;

thread_local! {
    static WATCHER: RefCell<Option<Watcher>> = const { RefCell::new(None) };
}

/// Calls `run` while `watcher` observes every disk operation of this thread: it is called before each, and if it
/// returns an error, the operation fails with that error. Tests use it to see what a full disk or an interrupted run
/// leaves behind.
pub fn watching_disk<T>(
    watcher: impl Fn(DiskOperation, &Path) -> io::Result<()> + 'static,
    run: impl FnOnce() -> T,
) -> T {
    let before = WATCHER.replace(Some(Rc::new(watcher)));
    let result = run();
    WATCHER.set(before);
    result
}

/// Tells the watcher of an operation on `path`, and does it.
pub(super) fn watched<T>(operation: DiskOperation, path: &Path, run: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    // the watcher may itself write files
    let watcher = WATCHER.with_borrow(Clone::clone);
    watcher.map_or(Ok(()), |watcher| watcher(operation, path))?;
    run()
}

/// A new file whose writes are reported to the watcher. Behind a buffer, one write is one full buffer.
#[derive(Debug)]
pub(super) struct NewFile {
    file: File,
    path: PathBuf,
}

impl NewFile {
    /// Makes the file, and locks it to show other processes that it is being written, for as long as it is open; where
    /// the file system has no locks they cannot tell.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let file = watched(DiskOperation::Other, path, || File::create_new(path))?;
        let _ = file.try_lock();
        Ok(Self { file, path: path.to_owned() })
    }

    pub(super) fn sync(&self) -> io::Result<()> {
        watched(DiskOperation::Other, &self.path, || self.file.sync_all())
    }

    /// Cuts the file off after `length` bytes, of which the first become `start`.
    pub(super) fn cut(&mut self, length: u64, start: &[u8]) -> io::Result<()> {
        watched(DiskOperation::Other, &self.path, || {
            self.file.set_len(length)?;
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(start)
        })
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        watched(DiskOperation::Other, &self.path, || self.file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Renames `from` to `to`, replacing a file or an empty folder of that name.
pub(super) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    watched(DiskOperation::Other, to, || std::fs::rename(from, to))
}

/// Gives the file `from` the name `to`, too, if nothing has it.
pub(super) fn link(from: &Path, to: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    watched(DiskOperation::Other, to, || match std::fs::hard_link(from, to) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            // a file system without links
            Ok(renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE)?)
        }
        other => other,
    })
}

/// Lets the folders `a` and `b` change their names in one step; `false` if the file system does not know how.
pub(super) fn exchange(a: &Path, b: &Path) -> io::Result<bool> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    let step = || Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?);
    let unknown = [Errno::INVAL, Errno::NOSYS, Errno::OPNOTSUPP, Errno::NOTSUP].map(|error| Some(error.raw_os_error()));
    match watched(DiskOperation::Exchange, b, step) {
        Err(error) if unknown.contains(&error.raw_os_error()) => Ok(false),
        other => other.map(|()| true),
    }
}

/// Waits until the entries of the folder `path` are on the disk.
pub(super) fn sync_folder(path: &Path) -> io::Result<()> {
    match watched(DiskOperation::Other, path, || File::open(path)?.sync_all()) {
        // some network file systems have no such thing for folders
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        other => other,
    }
}

/// Names of the files below a folder, sorted, and of the folder and those below it, parents first.
pub(super) type Below = (Vec<PathBuf>, Vec<PathBuf>);

/// What is in the folder `root`.
pub(super) fn below(root: &Path) -> io::Result<Below> {
    let (mut files, mut folders, mut read) = (Vec::new(), vec![PathBuf::new()], 0);
    while let Some(folder) = folders.get(read).cloned() {
        for entry in std::fs::read_dir(root.join(&folder))? {
            let entry = entry?;
            let kind = if entry.file_type()?.is_dir() { &mut folders } else { &mut files };
            kind.push(folder.join(entry.file_name()));
        }
        read += 1;
    }
    files.sort();
    Ok((files, folders))
}

/// Removes the file or the empty folder `path`.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    watched(DiskOperation::Remove, path, || match path.symlink_metadata()?.is_dir() {
        true => std::fs::remove_dir(path),
        false => std::fs::remove_file(path),
    })
}

/// Removes the folder `root` and what was found in it.
pub(super) fn remove_all(root: &Path, (files, folders): &Below) -> io::Result<()> {
    let mut all = files.iter().chain(folders.iter().rev());
    all.try_for_each(|name| remove(&root.join(name)))
}

/// Whether something has the name `path`, a link to nowhere as well.
pub(super) fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Folder of the file `path`.
pub(super) fn parent(path: &Path) -> &Path {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}
