//! Which algorithms are scored, on what, learned from where.

use super::algorithm::DecodeError;
use super::decoders::{DECODERS, Spec};
use super::external::{ExternalCommand, ExternalError};
use super::place::places;
use super::rows::{PlaceRow, ScoreBoard};
use super::run::{Course, Entry};
use super::teach::{School, Teaching};
use crate::learn::LearnError;
use crate::score::ScoredSession;
use crate::source::Source;
use spts_recon::Matrix;

/// Name of the dictionary and library that were published with the recordings.
pub const PUBLISHED: &str = "published";
/// Name of what was learned from raster presses of the scored recordings themselves.
pub const RASTER: &str = "raster";

/// Name of what is known of a skin that nothing may be learned from: random shapes on its layout.
pub const LAYOUT: &str = "layout";

/// What is to be scored.
pub struct Plan {
    /// Algorithms.
    pub decoders: Vec<&'static Spec>,
    /// External ones.
    pub external: Vec<ExternalCommand>,
    /// Numbers of measurements.
    pub measurements: Vec<usize>,
    /// Objects that are scored; all when none is named.
    pub objects: Vec<String>,
    /// Numbers of measurements for the bouncing ball.
    pub localisation: Vec<usize>,
    /// Whether every algorithm is also scored with the scored object kept out of what it learned from.
    pub left_out: bool,
    /// What is learned from; every algorithm is scored once with each.
    pub teachings: Vec<Teaching>,
    /// Whether decodes are timed.
    pub times: bool,
    /// Root of the random numbers of dictionary learning.
    pub seed: u64,
}

/// Why there is no board.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// Nothing to score.
    #[error("no object has both a raster and a compressive session")]
    NoSession,
    /// An object that has no compressive session.
    #[error("object {name:?} has no compressive session; valid: {valid}")]
    Object {
        /// The name.
        name: String,
        /// Those that have one.
        valid: String,
    },
    /// What was to be learned from is of another skin.
    #[error("{name}: the raster session of {object} has {taxels} taxels; the scored skin has {needed}")]
    Taxels {
        /// The source.
        name: String,
        /// An object of it.
        object: String,
        /// Its taxels.
        taxels: usize,
        /// Taxels of the scored skin.
        needed: usize,
    },
    /// Nothing could be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// An external program cannot be started.
    #[error(transparent)]
    External(#[from] ExternalError),
    /// An algorithm failed.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// The sheet is no grid.
    #[error(transparent)]
    Place(#[from] spts_recon::RangeError),
}

/// Algorithms that have learned, and the presses that wait for them.
pub struct Ready<'a> {
    plan: &'a Plan,
    source: &'a Source,
    course: Course<'a>,
    entries: Vec<Entry>,
    /// For the ball.
    dictionary: Option<Matrix>,
}

impl Ready<'_> {
    /// Number of presses, after each of which [`Ready::score`] reports.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.course.presses().len()
    }

    /// Decodes and scores every press; `done` is called after each.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn score(&self, done: &(dyn Fn() + Sync)) -> Result<ScoreBoard, BoardError> {
        let (rows, objects) = self.course.score(&self.entries, done)?;
        Ok(ScoreBoard {
            rows,
            localisation: Vec::new(),
            objects,
        })
    }

    /// Rows of the bouncing ball; none without a recording of it.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn localise(&self) -> Result<Vec<PlaceRow>, BoardError> {
        let (Some(bounces), Some(dictionary)) = (&self.source.bounces, &self.dictionary) else {
            return Ok(Vec::new());
        };
        let shifted = self.source.shifted(dictionary);
        Ok(places(
            bounces,
            shifted,
            self.source.layout.cols(),
            &self.plan.localisation,
        )?)
    }
}

/// The published dictionary, or the one that is learned without it.
fn dictionary(source: &Source, school: &mut School<'_>) -> Result<Matrix, LearnError> {
    match &source.published {
        Some(published) => Ok(published.dictionary.clone()),
        None => Ok(school
            .lessons(&Teaching::Raster, false, None)?
            .dictionary()?
            .atoms
            .clone()),
    }
}

impl Plan {
    /// The default numbers of measurements.
    pub const MEASUREMENTS: [usize; 8] = [5, 7, 10, 13, 20, 25, 50, 100];
    /// The default numbers of measurements for the ball.
    pub const LOCALISATION: [usize; 6] = [5, 7, 10, 15, 20, 25];

    /// The algorithms shown when none is named.
    #[must_use]
    pub fn shown() -> Vec<&'static Spec> {
        DECODERS.iter().filter(|spec| spec.shown).collect()
    }

    /// Learns everything that [`Ready::score`] needs.
    ///
    /// # Errors
    /// [`BoardError`] when there is nothing to score or nothing can be learned.
    pub fn learn<'a>(&'a self, source: &'a Source) -> Result<Ready<'a>, BoardError> {
        let course = self.course(source);
        let scored: Vec<&str> = course.sessions.iter().map(|s| s.object.as_str()).collect();
        if let Some(name) = self.objects.iter().find(|name| !scored.contains(&name.as_str())) {
            let valid = source.sessions.iter().filter(|s| s.scorable());
            return Err(BoardError::Object {
                name: name.clone(),
                valid: valid.map(|s| s.object.as_str()).collect::<Vec<_>>().join(", "),
            });
        }
        if course.sessions.is_empty() {
            return Err(BoardError::NoSession);
        }
        let mut school = School::new(source, self.seed);
        let entries = school.entries(self, &scored)?;
        let ball = !self.localisation.is_empty() && source.bounces.is_some();
        let dictionary = ball.then(|| dictionary(source, &mut school)).transpose()?;
        Ok(Ready {
            plan: self,
            source,
            course,
            entries,
            dictionary,
        })
    }

    fn course<'a>(&self, source: &'a Source) -> Course<'a> {
        let asked = |s: &&ScoredSession| {
            self.objects.is_empty() || self.objects.contains(&s.object) || self.objects.contains(&s.name)
        };
        let sessions = source.sessions.iter().filter(|s| s.scorable()).filter(asked);
        Course {
            sessions: sessions.collect(),
            measurements: self.measurements.clone(),
            times: self.times,
        }
    }
}
