//! Opens recordings: a session, a folder of sessions, or a published layout.

use super::error::DataError;
use super::published::PublishedFiles;
use super::set::{SessionSet, published_place};
use crate::session::{Event, SESSION_FILE, Session};
use std::path::{Path, PathBuf};

/// Folders below the one that is opened in which sessions are looked for.
const DEPTH: usize = 3;

impl SessionSet {
    /// Reads the sessions in `root`:
    ///
    /// - a folder with `session.json` is one session;
    /// - a folder with such folders below it, at most three levels down, is all of them;
    /// - else `root` is searched for the published recordings: in this project's layout, in the published repository's,
    ///   or the root of a clone of that.
    ///
    /// # Errors
    /// [`DataError`] when there is no session at all, or one that is there cannot be read.
    pub fn open(root: &Path) -> Result<Self, DataError> {
        if root.is_file() {
            let beside = root.file_name().is_some_and(|name| name == SESSION_FILE);
            if let Some(folder) = root.parent().filter(|_| beside) {
                return Self::open(folder);
            }
        }
        let mut folders = Vec::new();
        find(root, DEPTH, &mut folders)?;
        if folders.is_empty() {
            return PublishedFiles::open(root)?.read();
        }
        let sessions = folders.iter().map(|folder| Session::read(folder));
        let mut sessions = sessions.collect::<Result<Vec<_>, _>>()?;
        sort(&mut sessions);
        Ok(Self {
            root: root.to_owned(),
            sessions,
            published: None,
            missing: Vec::new(),
        })
    }
}

/// Sessions of the published objects in the order of their labels, then the others by name.
fn sort(sessions: &mut [Session]) {
    sessions.sort_by(|a, b| {
        let key = |s: &Session| (s.event != Event::Press, published_place(&s.object));
        key(a).cmp(&key(b)).then_with(|| a.name.cmp(&b.name))
    });
}

/// Folders with a session in them, `depth` levels down, sorted.
fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), DataError> {
    if folder.join(SESSION_FILE).is_file() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let io = |source| DataError::Io {
        path: folder.to_owned(),
        source,
    };
    let mut below = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if !hidden && entry.file_type().map_err(io)?.is_dir() {
            below.push(entry.path());
        }
    }
    below.sort();
    if depth > 0 {
        below.iter().try_for_each(|folder| find(folder, depth - 1, found))?;
    }
    Ok(())
}
