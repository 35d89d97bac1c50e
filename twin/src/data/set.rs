//! The sessions in one folder, and what was published with them.

use crate::session::{Event, Session};
use spts_circuit::Recording;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::path::PathBuf;

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
}

/// Dictionary, shifted dictionary and classifier library, as published.
#[derive(Debug, Clone)]
pub struct Published {
    /// K-SVD dictionary, 100 × 100.
    pub dictionary: Matrix,
    /// Shifted copies of the dictionary, 100 × 2450; `None` if the file is missing.
    pub shifted: Option<Matrix>,
    /// Labelled raster images. The label of an object is its place among the published objects, from 1.
    pub library: Library,
}

impl SessionSet {
    /// The session called `name`.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Session> {
        self.sessions.iter().find(|s| s.name == name)
    }

    /// Sessions in which an object was pressed.
    pub fn presses(&self) -> impl Iterator<Item = &Session> {
        self.sessions.iter().filter(|s| s.event == Event::Press)
    }

    /// Compressive recording of the first session in which an object was dropped.
    #[must_use]
    pub fn drops(&self) -> Option<&Recording> {
        let drops = self.sessions.iter().filter(|s| s.event == Event::Drop);
        drops.filter_map(Session::compressive).next()
    }
}

/// Place of an object among the published ones; all others come after them.
pub(super) fn published_place(object: &str) -> usize {
    let place = spts_contact::objects::OBJECTS.iter().position(|o| o.name == object);
    place.unwrap_or(usize::MAX)
}
