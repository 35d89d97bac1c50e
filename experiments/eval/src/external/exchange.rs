//! The temporary folder for files exchanged with a program.

use super::in_file;
use crate::algorithm::ExternalError;
use spts::cleanup::{Entry, Leftover, listed};
use std::fs::{DirEntry, File};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Start of the folder's name.
const PREFIX: &str = "spts-external-";
/// File that is locked while the folder is in use. The operating system gives the lock up when `spts` ends, however it
/// does.
const LOCK: &str = ".in-use";

/// The folder. It is removed when dropped, and when a signal ends `spts`. One that was left by a run that was killed is
/// removed by the next run.
#[derive(Debug)]
pub(super) struct Exchange {
    // in the order in which they go
    folder: TempDir,
    _lock: File,
    _entry: Entry,
}

impl Exchange {
    /// Makes the folder in the system's folder of temporary files.
    ///
    /// # Errors
    /// [`ExternalError::File`] when it cannot be made, or its path is no text in UTF-8, which JSON needs.
    pub(super) fn new() -> Result<Self, ExternalError> {
        let parent = std::env::temp_dir();
        if parent.to_str().is_none() {
            return Err(in_file(&parent, io::ErrorKind::InvalidFilename.into()));
        }
        sweep(&parent);
        let make = || {
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(&parent)?;
            // locked before it has its name, so that no other run takes it for one that was left
            let mut lock = tempfile::NamedTempFile::new_in(folder.path())?;
            lock.as_file_mut().lock()?;
            let lock = lock.persist(folder.path().join(LOCK))?;
            Ok((folder, lock))
        };
        let made = listed(make, |(folder, _)| Leftover::Folder(folder.path().to_owned()));
        let ((folder, lock), entry) = made.map_err(|source| in_file(&parent, source))?;
        Ok(Self {
            folder,
            _lock: lock,
            _entry: entry,
        })
    }

    /// The file called `name`.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// Removes the folders below `parent` that runs have left which were killed: those with a lock file that nobody holds.
fn sweep(parent: &Path) {
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(PREFIX) && is_left(&entry) {
            // another run may be removing it too
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Whether `entry` is a folder, of the same user as its lock file, which nobody holds.
fn is_left(entry: &DirEntry) -> bool {
    let lock = entry.path().join(LOCK);
    let (Ok(folder), Ok(found)) = (entry.metadata(), lock.symlink_metadata()) else {
        return false;
    };
    let ours = folder.is_dir() && found.is_file() && found.len() == 0 && folder.uid() == found.uid();
    ours && File::open(&lock).is_ok_and(|file| file.try_lock().is_ok())
}

/// What stands for a file in a command, and the environment variable that has the same path.
pub(super) const PLACEHOLDERS: [(&str, &str); 3] = [
    ("{learn}", "SPTS_LEARN"),
    ("{windows}", "SPTS_WINDOWS"),
    ("{answers}", "SPTS_ANSWERS"),
];

/// The command that lets the shell run `text` with a path of `files` in place of each placeholder, in their order. The
/// program finds the paths in its environment, too.
///
/// A path of letters, digits and `/._-` is written as it is. Any other is left to the shell's expansion of the
/// variable, whose value the shell never reads as a command, wherever the placeholder stands.
pub(super) fn shell(text: &str, files: &[Option<&Path>; 3]) -> Command {
    let mut text = text.to_owned();
    let mut command = Command::new("sh");
    for ((placeholder, variable), path) in PLACEHOLDERS.iter().zip(files) {
        let Some(path) = path else { continue };
        command.env(variable, path);
        let is_plain = |path: &&str| path.bytes().all(|b| b.is_ascii_alphanumeric() || b"/._-".contains(&b));
        text = match path.to_str().filter(is_plain) {
            Some(plain) => text.replace(placeholder, plain),
            None => text.replace(placeholder, &format!("\"${{{variable}}}\"")),
        };
    }
    command.arg("-c").arg(text);
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_never_run_and_stays_one_word() {
        let parent = tempfile::tempdir().unwrap();
        for name in [
            "plain",
            "a b",
            "$(touch run)",
            "`touch run`",
            "'; touch run; '",
            "{answers}",
        ] {
            let path = parent.path().join(name);
            std::fs::write(&path, name).unwrap();
            for (text, safe) in [
                ("cat {windows}", true),
                ("cat \"{windows}\"", false),
                ("cat '{windows}'", false),
            ] {
                let output = shell(text, &[None, Some(&path), Some(parent.path())]);
                let mut output = output;
                let output = output.current_dir(parent.path()).output().unwrap();
                assert!(!parent.path().join("run").exists(), "{text} with {name}");
                if safe || name == "plain" {
                    assert_eq!(String::from_utf8_lossy(&output.stdout), name, "{text}");
                }
            }
        }
    }

    #[test]
    fn only_folders_that_nobody_uses_are_swept() {
        let parent = tempfile::tempdir().unwrap();
        let folder = |name: &str, lock: bool| {
            let path = parent.path().join(format!("{PREFIX}{name}"));
            std::fs::create_dir(&path).unwrap();
            lock.then(|| File::create(path.join(LOCK)).unwrap())
        };
        drop(folder("left", true));
        let used = folder("used", true).unwrap();
        used.lock().unwrap();
        folder("foreign", false);
        sweep(parent.path());
        let names = std::fs::read_dir(parent.path()).unwrap();
        let mut names: Vec<String> = names.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        assert_eq!(names, ["spts-external-foreign", "spts-external-used"]);
    }
}
