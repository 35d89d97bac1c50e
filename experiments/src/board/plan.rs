//! Which algorithms are scored, on what, learned from where.

use super::algorithm::{DecodeError, Trained};
use super::decoders::{DECODERS, Needs, Spec};
use super::external::{External, ExternalCommand};
use super::lessons::{LearnError, Lessons};
use super::place::places;
use super::rows::ScoreBoard;
use super::run::{Course, Entry, Pupil};
use super::source::Source;
use crate::score::Session;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::Src;
use std::sync::Arc;

/// Name of the dictionary and library that were published with the recordings.
pub const PUBLISHED: &str = "published";
/// Name of what was learned from raster presses of the scored recordings themselves.
pub const RASTER: &str = "raster";

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
    /// Sessions of another source to learn from, and its name; replaces the recordings' own lessons.
    pub learn_from: Option<(String, Vec<Session>)>,
    /// Whether a published dictionary and library, where there are any, are used.
    pub published: bool,
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
    /// Nothing could be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
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
}

impl Ready<'_> {
    /// Number of presses, after each of which [`Ready::score`] reports.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.course.presses().len()
    }

    /// Decodes and scores; `done` is called after every press.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn score(&self, done: &(dyn Fn() + Sync)) -> Result<ScoreBoard, BoardError> {
        let (rows, objects) = self.course.score(&self.entries, done)?;
        let localisation = match &self.source.bounces {
            Some(bounces) if !self.plan.localisation.is_empty() => {
                let shifted = self.source.shifted(&self.plan.dictionary(self.source)?);
                places(bounces, shifted, self.source.cols, &self.plan.localisation)?
            }
            _ => Vec::new(),
        };
        Ok(ScoreBoard {
            rows,
            localisation,
            objects,
        })
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
            let valid = source.sessions.iter().filter(|s| s.compressive.is_some());
            return Err(BoardError::Object {
                name: name.clone(),
                valid: valid.map(|s| s.object.as_str()).collect::<Vec<_>>().join(", "),
            });
        }
        if course.sessions.is_empty() {
            return Err(BoardError::NoSession);
        }
        let entries = self.entries(source, &course)?;
        Ok(Ready {
            plan: self,
            source,
            course,
            entries,
        })
    }

    fn course<'a>(&self, source: &'a Source) -> Course<'a> {
        let asked = |s: &&Session| self.objects.is_empty() || self.objects.contains(&s.object);
        let sessions = source.sessions.iter().filter(|s| s.compressive.is_some()).filter(asked);
        Course {
            sessions: sessions.collect(),
            protocol: source.protocol,
            measurements: self.measurements.clone(),
            times: self.times,
        }
    }

    /// The published dictionary, or the one that is learned without it.
    fn dictionary(&self, source: &Source) -> Result<Matrix, LearnError> {
        match &source.published {
            Some(published) => Ok(published.dictionary.clone()),
            None => Ok(self.lessons(source, None)?.dictionary()?.atoms.clone()),
        }
    }

    /// What may be learned about everything but the object `left_out`.
    fn lessons(&self, source: &Source, left_out: Option<&str>) -> Result<Lessons, LearnError> {
        let (name, sessions, scored) = match &self.learn_from {
            Some((name, sessions)) => (name.as_str(), sessions, None),
            None => (RASTER, &source.sessions, Some(&source.raster_protocol)),
        };
        Lessons::from_raster(name, sessions, left_out, scored, source.cols, Streams::new(self.seed))
    }

    fn entries(&self, source: &Source, course: &Course<'_>) -> Result<Vec<Entry>, LearnError> {
        let raster = self.lessons(source, None)?;
        let own = self.learn_from.is_none() && self.published;
        let published = source.published.as_ref().filter(|_| own);
        let published = published.map(|p| raster.clone().with_published(&p.dictionary, &p.library));
        let mut entries = Vec::new();
        let closed = |spec: &Spec| match (&published, spec.needs) {
            (Some(published), Needs::Dictionary) => published,
            _ => &raster,
        };
        let number = course.sessions.len();
        for spec in &self.decoders {
            let lessons = closed(spec);
            let pupil = pupil((spec.train)(lessons)?, lessons);
            entries.push(entry(spec.name, spec.needs, lessons, vec![pupil; number]));
        }
        for (k, command) in self.external.iter().enumerate() {
            let lessons = published.as_ref().unwrap_or(&raster);
            let pupil = pupil(Box::new(External::start(&command.command, lessons, k)?), lessons);
            entries.push(entry(&command.name, Needs::Dictionary, lessons, vec![pupil; number]));
        }
        if self.left_out {
            entries.extend(self.left_out_entries(source, course)?);
        }
        Ok(entries)
    }

    fn left_out_entries(&self, source: &Source, course: &Course<'_>) -> Result<Vec<Entry>, LearnError> {
        let lessons = course
            .sessions
            .iter()
            .map(|s| self.lessons(source, Some(&s.object)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut entries = Vec::new();
        for spec in &self.decoders {
            let pupils = lessons.iter().map(|l| Ok(pupil((spec.train)(l)?, l)));
            let pupils = pupils.collect::<Result<Vec<_>, LearnError>>()?;
            entries.push(entry(spec.name, spec.needs, &lessons[0], pupils));
        }
        for (k, command) in self.external.iter().enumerate() {
            let pupils = lessons.iter().enumerate().map(|(i, l)| {
                let number = self.external.len() + k * lessons.len() + i;
                Ok(pupil(Box::new(External::start(&command.command, l, number)?), l))
            });
            let pupils = pupils.collect::<Result<Vec<_>, LearnError>>()?;
            entries.push(entry(&command.name, Needs::Dictionary, &lessons[0], pupils));
        }
        Ok(entries)
    }
}

fn pupil(trained: Box<dyn Trained>, lessons: &Lessons) -> Pupil {
    Pupil {
        trained: Arc::from(trained),
        classifier: Arc::new(Src::new(lessons.library.clone(), Src::PUBLISHED_SPARSITY)),
    }
}

fn entry(name: &str, needs: Needs, lessons: &Lessons, pupils: Vec<Pupil>) -> Entry {
    let learned_from = match needs {
        Needs::Nothing => "nothing",
        _ => lessons.source.as_str(),
    };
    Entry {
        name: name.to_owned(),
        learned_from: learned_from.to_owned(),
        left_out: lessons.left_out.is_some(),
        pupils,
    }
}
