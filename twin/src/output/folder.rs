//! The folder of one run's results: all of them appear together, or none.

use super::error::OutputError;
use std::path::{Path, PathBuf};

/// Folder for results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Refuses a `path` that cannot become a folder, without touching anything.
    ///
    /// # Errors
    /// [`OutputError::IsFile`] when it or one of its parents is a file.
    pub fn check(path: &Path) -> Result<(), OutputError> {
        match path.ancestors().find(|p| p.exists()) {
            Some(found) if !found.is_dir() => Err(OutputError::IsFile { path: found.to_owned() }),
            _ => Ok(()),
        }
    }

    /// Makes the folder `path` and its parents where they are missing.
    ///
    /// # Errors
    /// [`OutputError`] when a file is in the way or the file system says no.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        Self::check(path)?;
        std::fs::create_dir_all(path).map_err(|source| OutputError::Folder {
            path: path.to_owned(),
            source,
        })?;
        Ok(Self { path: path.to_owned() })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A place in the folder where results wait until all of them are there.
    ///
    /// # Errors
    /// [`OutputError::Folder`] when it cannot be made.
    pub fn stage(&self) -> Result<Staged, OutputError> {
        self.sweep();
        let stage = self.path.join(format!(".{}.part", std::process::id()));
        std::fs::create_dir_all(&stage).map_err(|source| OutputError::Folder {
            path: stage.clone(),
            source,
        })?;
        Ok(Staged {
            folder: self.path.clone(),
            stage,
        })
    }
}

impl OutputFolder {
    /// Removes what runs that were killed have left waiting here.
    fn sweep(&self) {
        for entry in std::fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let process = name.strip_prefix('.').and_then(|n| n.strip_suffix(".part"));
            let Some(process) = process.and_then(|p| p.parse::<u32>().ok()) else {
                continue;
            };
            if Path::new("/proc/self").exists() && !Path::new(&format!("/proc/{process}")).exists() {
                // what does not go away does no harm
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
    }
}

/// Results that wait to be moved into their folder. What was not committed is removed.
#[derive(Debug)]
pub struct Staged {
    folder: PathBuf,
    stage: PathBuf,
}

impl Staged {
    /// Where to write the result called `name`, which may lie in a folder of its own (`tables/scores.csv`) that
    /// [`Staged::folder`] has made.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.stage.join(name)
    }

    /// Makes the folder `name` for results.
    ///
    /// # Errors
    /// [`OutputError::Folder`] when it cannot be made.
    pub fn folder(&self, name: &str) -> Result<PathBuf, OutputError> {
        Ok(OutputFolder::create(&self.stage.join(name))?.path)
    }

    /// Moves all results into the folder, replacing files of the same names. Returns their names, sorted.
    ///
    /// # Errors
    /// [`OutputError`] when a file cannot be moved; something that is not a regular file is never replaced.
    pub fn commit(self) -> Result<Vec<String>, OutputError> {
        let mut names = Vec::new();
        self.collect(Path::new(""), &mut names)
            .map_err(OutputError::write(&self.folder))?;
        names.sort();
        let targets: Vec<PathBuf> = names.iter().map(|name| self.folder.join(name)).collect();
        for target in &targets {
            if std::fs::metadata(target).is_ok_and(|found| !found.is_file()) {
                return Err(OutputError::NotRegular { path: target.clone() });
            }
            OutputFolder::create(target.parent().unwrap_or(&self.folder))?;
        }
        for (name, target) in names.iter().zip(&targets) {
            std::fs::rename(self.stage.join(name), target).map_err(OutputError::write(target))?;
        }
        Ok(names.iter().map(|name| name.to_string_lossy().into_owned()).collect())
    }

    /// Moves all results into the folder as [`Staged::commit`] does, and removes what an earlier run has left there:
    /// the files that `is_ours` knows by their name in the folder, and that this run has not written.
    ///
    /// # Errors
    /// As for [`Staged::commit`].
    pub fn commit_replacing(self, is_ours: &dyn Fn(&str) -> bool) -> Result<Vec<String>, OutputError> {
        let folder = self.folder.clone();
        let names = self.commit()?;
        for below in ["", "tables"] {
            for entry in std::fs::read_dir(folder.join(below)).into_iter().flatten().flatten() {
                let name = Path::new(below).join(entry.file_name()).to_string_lossy().into_owned();
                if is_ours(&name) && !names.contains(&name) {
                    std::fs::remove_file(entry.path()).map_err(OutputError::write(&entry.path()))?;
                }
            }
        }
        Ok(names)
    }

    /// Names of all staged files below the folder `below`.
    fn collect(&self, below: &Path, names: &mut Vec<PathBuf>) -> std::io::Result<()> {
        for entry in std::fs::read_dir(self.stage.join(below))? {
            let entry = entry?;
            let name = below.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                self.collect(&name, names)?;
            } else {
                names.push(name);
            }
        }
        Ok(())
    }

    /// The error as the user should see it: with the result's final place instead of where it waited.
    #[must_use]
    pub fn unstaged(&self, error: OutputError) -> OutputError {
        error.relocated(&|path| self.final_path(path))
    }

    /// Where the result that waits at `path` will be; any other path as it is.
    #[must_use]
    pub fn final_path(&self, path: &Path) -> PathBuf {
        path.strip_prefix(&self.stage)
            .map_or_else(|_| path.to_owned(), |name| self.folder.join(name))
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // nothing more can be done about a folder that does not go away
        let _ = std::fs::remove_dir_all(&self.stage);
    }
}
