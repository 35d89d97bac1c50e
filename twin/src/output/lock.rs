//! Locks a folder, so that only one run writes to it at a time.

use super::disk;
use super::error::OutputError;
use crate::cleanup::{Entry, Leftover, listed};
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// File that a run holds locked while the folder is its own.
pub(super) const LOCK_FILE: &str = ".spts.lock";

/// The lock of a folder, given up when dropped. The operating system holds it (`flock`), not a process number in a
/// file: it holds between containers, and a run that was killed does not hold it.
#[derive(Debug)]
pub(super) struct Lock {
    file: Option<File>,
    path: PathBuf,
    /// Lets a signal remove the file; `None` where this is not possible.
    entry: Option<Entry>,
}

impl Lock {
    /// Locks `folder`, which exists.
    ///
    /// # Errors
    /// [`OutputError::Locked`] when another run holds it, [`OutputError::Write`] when the folder is not writable.
    pub(super) fn take(folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join(LOCK_FILE);
        let failed = OutputError::write(folder);
        loop {
            let file = disk::open_or_create(&path).map_err(&failed)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(OutputError::Locked {
                        folder: folder.to_owned(),
                    });
                }
                // a file system without locks: one run at a time is then the user's to see to
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(error)) => return Err(failed(error)),
            }
            // the run before may have removed the file between its opening and its locking
            if is_same(&file, &path) {
                return Ok(Self {
                    file: Some(file),
                    entry: on_list(&path),
                    path,
                });
            }
        }
    }

    /// The lock of the same folder where that has the name `folder`.
    pub(super) fn moved_to(mut self, folder: &Path) -> Self {
        self.path = folder.join(LOCK_FILE);
        self.entry = on_list(&self.path);
        self
    }

    /// Gives up the lock and leaves its file: for a folder that is about to be removed.
    pub(super) fn leave(mut self) {
        self.file = None;
        self.entry = None;
    }
}

/// Puts the lock file on the list of what a signal removes.
fn on_list(path: &Path) -> Option<Entry> {
    let entry = listed(|| Ok(()), |()| Leftover::File(path.to_owned()));
    entry.ok().map(|((), entry)| entry)
}

fn is_same(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |m: std::fs::Metadata| (m.dev(), m.ino());
    let held = file.metadata().map(identity);
    let named = path.metadata().map(identity);
    matches!((held, named), (Ok(held), Ok(named)) if held == named)
}

impl Drop for Lock {
    fn drop(&mut self) {
        if self.file.is_some() {
            // while it is still locked, so that no other run holds a file that is gone
            let _ = disk::remove_file(&self.path);
        }
    }
}
