//! Sessions of one place, and what was published with them.

use crate::session::{Event, Session};
use spts_circuit::Recording;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::path::PathBuf;

/// All sessions in one place.
#[derive(Debug, Clone)]
pub struct SessionSet {
    /// What was opened.
    pub root: PathBuf,
    /// The sessions: of the published objects in the order of their labels, then of others by name.
    pub sessions: Vec<Session>,
    /// Dictionary and library that were published with them.
    pub published: Option<Published>,
    /// What a published layout usually has and this one has not.
    pub missing: Vec<String>,
}

/// Dictionary, shifted dictionary and classifier library as published.
#[derive(Debug, Clone)]
pub struct Published {
    /// K-SVD dictionary, 100 × 100.
    pub dictionary: Matrix,
    /// Its shifted copies, 100 × 2450; absent when the file is.
    pub shifted: Option<Matrix>,
    /// Labelled raster images; an object's label is its place among the published ones, from 1.
    pub library: Library,
}

impl SessionSet {
    /// The session called `name`.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Session> {
        self.sessions.iter().find(|s| s.name == name)
    }

    /// Sessions in which something was pressed.
    pub fn presses(&self) -> impl Iterator<Item = &Session> {
        self.sessions.iter().filter(|s| s.event == Event::Press)
    }

    /// Compressive recording of the first session in which something was dropped.
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
