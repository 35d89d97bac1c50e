//! Opens recordings: a session, a folder of sessions, or the published recordings.

use super::published::{Published, PublishedFiles, published_place, square};
use crate::session::{Event, SESSION_FILE, Session};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Folders below the one that is opened in which sessions are looked for.
const DEPTH: usize = 3;

/// All sessions of one folder, and what was published with them.
///
/// ```
/// use spts::data::SessionSet;
///
/// # let folder = std::env::temp_dir().join(format!("spts-doc-set-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// let error = SessionSet::open(&folder).unwrap_err();
/// assert!(error.to_string().contains("no recordings found; expected session.json"));
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SessionSet {
    /// The folder that was opened.
    pub root: PathBuf,
    /// The sessions: first those of the published objects in order of their labels, then the others by name.
    pub sessions: Vec<Session>,
    /// Dictionary and library, if they were published with the sessions.
    pub published: Option<Published>,
    /// Parts of the published layout that this folder lacks.
    pub missing: Vec<String>,
    /// What a user has to know about how the files were read; `None` if they can be read in one way alone.
    pub note: Option<String>,
}

impl SessionSet {
    /// Reads the sessions in `root`:
    ///
    /// - a folder with `session.json` is one session;
    /// - a folder that holds such folders, at most three levels deep, is the set of these sessions. Sessions whose
    ///   names repeat are named after their folders. The published dictionary and library are used if they lie in
    ///   `root` itself;
    /// - any other folder is searched for the published recordings: in this project's layout, in the layout of the
    ///   published repository, or in a clone of it.
    ///
    /// # Errors
    /// [`Refusal`] if there is no session, a session cannot be read, or two sessions have the same name.
    pub fn open(root: &Path) -> Result<Self, Refusal> {
        if !root.is_dir() {
            let beside = root.file_name().is_some_and(|name| name == SESSION_FILE);
            if let Some(folder) = root.parent().filter(|_| beside) {
                return Self::open(folder);
            }
        }
        let mut folders = Vec::new();
        find(root, DEPTH, &mut folders)?;
        if folders.is_empty() {
            let (sessions, published, missing) = PublishedFiles::open(root)?.read()?;
            let note = square(&sessions);
            return Ok(Self { root: root.to_owned(), sessions, published, missing, note });
        }
        let sessions = folders.iter().map(|folder| Session::read(folder));
        let mut sessions = sessions.collect::<Result<Vec<_>, _>>()?;
        tell_apart(root, &folders, &mut sessions)?;
        sort(&mut sessions);
        // they are of the published skin
        let published_skin = SkinLayout::default().taxels();
        let fits = |session: &Session| session.layout().is_none_or(|layout| layout.taxels() == published_skin);
        let published = match sessions.iter().all(fits) {
            true => PublishedFiles::beside(root)?,
            false => None,
        };
        Ok(Self { root: root.to_owned(), sessions, published, missing: Vec::new(), note: None })
    }

    /// The session called `name`.
    pub fn named(&self, name: &str) -> Option<&Session> {
        self.sessions.iter().find(|s| s.name == name)
    }

    /// Sessions in which an object was pressed.
    pub fn presses(&self) -> impl Iterator<Item = &Session> {
        self.sessions.iter().filter(|s| s.event == Event::Press)
    }

    /// Compressive recording of the first session in which an object was dropped.
    pub fn drops(&self) -> Option<&Recording> {
        let drops = self.sessions.iter().filter(|s| s.event == Event::Drop);
        drops.filter_map(Session::compressive).next()
    }
}

/// Names sessions whose names repeat by their folders below `root`.
fn tell_apart(root: &Path, folders: &[PathBuf], sessions: &mut [Session]) -> Result<(), Refusal> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for session in sessions.iter() {
        *counts.entry(session.name.clone()).or_default() += 1;
    }
    let mut named: BTreeMap<String, &PathBuf> = BTreeMap::new();
    for (session, folder) in sessions.iter_mut().zip(folders) {
        if counts.get(&session.name).is_some_and(|count| *count > 1) {
            let below = folder.strip_prefix(root).unwrap_or(folder);
            let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
            session.name = parts.join("_");
        }
        if let Some(first) = named.insert(session.name.clone(), folder) {
            return Err(Refusal::new(format!(
                "{} and {}: `name` = {:?} of both sessions; valid: names that differ",
                first.display(),
                folder.display(),
                session.name
            )));
        }
    }
    Ok(())
}

/// Sessions of the published objects in the order of their labels, then the others by name.
fn sort(sessions: &mut [Session]) {
    sessions.sort_by(|a, b| {
        let key = |s: &Session| (s.event != Event::Press, published_place(&s.object));
        key(a).cmp(&key(b)).then_with(|| a.name.cmp(&b.name))
    });
}

/// Folders with a session in them, `depth` levels down, sorted.
fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), Refusal> {
    // what is there but no regular file is named when it is read
    if folder.join(SESSION_FILE).exists() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let io = Refusal::in_file(folder);
    let mut below = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&io)? {
        let entry = entry.map_err(&io)?;
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if !hidden && entry.file_type().map_err(&io)?.is_dir() {
            below.push(entry.path());
        }
    }
    below.sort();
    if depth > 0 {
        below.iter().try_for_each(|folder| find(folder, depth - 1, found))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_of_one_name_are_named_by_their_folders() {
        let dir = tempfile::tempdir().unwrap();
        let write = |folder: &str, name: &str| Session::new(name, Event::Press).write(&dir.path().join(folder));
        for (folder, name) in [("b/run", "T"), ("a/run", "T"), ("c", "cup")] {
            write(folder, name).unwrap();
        }
        let set = SessionSet::open(dir.path()).unwrap();
        let found: Vec<_> = set.sessions.iter().map(|s| (s.name.as_str(), s.object.as_str())).collect();
        let mut sorted = set.sessions.clone();
        sort(&mut sorted);
        assert_eq!(set.sessions, sorted);
        assert_eq!(found.len(), 3);
        for expected in [("a_run", "T"), ("b_run", "T"), ("cup", "cup")] {
            assert!(found.contains(&expected), "{expected:?} in {found:?}");
        }
        write("d", "a_run").unwrap();
        let said = SessionSet::open(dir.path()).unwrap_err().to_string();
        for expected in ["a/run and ", "/d: ", "`name` = \"a_run\""] {
            assert!(said.contains(expected), "{expected} in {said}");
        }
    }

    /// Files of the published dictionary and library are read where both lie in the folder that is opened.
    #[test]
    fn the_published_files_count_beside_the_sessions() {
        let dir = tempfile::tempdir().unwrap();
        Session::new("T", Event::Press).write(&dir.path().join("T")).unwrap();
        std::fs::write(dir.path().join("dictionary.mat"), "no matrix").unwrap();
        assert!(SessionSet::open(dir.path()).unwrap().published.is_none());
        std::fs::write(dir.path().join("SRC_lib.mat"), "no matrix").unwrap();
        let said = SessionSet::open(dir.path()).unwrap_err().to_string();
        assert!(said.contains("SRC_lib.mat"), "{said}");
    }
}
