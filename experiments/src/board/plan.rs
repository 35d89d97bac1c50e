//! Which algorithms are scored, on what, learned from where.

use super::algorithm::{DecodeError, Trained};
use super::decoders::{DECODERS, Needs, Spec};
use super::external::External;
use super::lessons::{LearnError, Lessons};
use super::place::places;
use super::rows::ScoreBoard;
use super::run::{Course, Entry, Pupil};
use crate::score::{Arm, Session};
use spts_models::Streams;
use spts_recon::classify::Src;
use std::sync::Arc;

/// Name of what was learned from raster presses of the scored recordings themselves.
pub const RASTER: &str = "raster";

/// What is to be scored.
pub struct Plan {
    /// Algorithms.
    pub decoders: Vec<&'static Spec>,
    /// Commands of external ones.
    pub external: Vec<String>,
    /// Numbers of measurements.
    pub measurements: Vec<usize>,
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

/// Recordings ready to be scored.
pub struct Scored<'a> {
    /// Sessions, ball and, where published, dictionary and library.
    pub arm: &'a Arm,
    /// Whether dictionary and library of the arm are published ones.
    pub published: bool,
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

    /// Number of times [`Plan::run`] reports progress.
    #[must_use]
    pub fn steps(&self, scored: &Scored<'_>) -> usize {
        self.course(scored).presses().len()
    }

    /// Learns and scores; `done` is called after every press.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn run(&self, scored: &Scored<'_>, done: &(dyn Fn() + Sync)) -> Result<ScoreBoard, BoardError> {
        let course = self.course(scored);
        if course.sessions.is_empty() {
            return Err(BoardError::NoSession);
        }
        let entries = self.entries(scored, &course)?;
        let (rows, objects) = course.score(&entries, done)?;
        Ok(ScoreBoard {
            rows,
            localisation: places(scored.arm, &self.localisation)?,
            objects,
        })
    }

    fn course<'a>(&self, scored: &Scored<'a>) -> Course<'a> {
        let sessions = scored.arm.sessions.iter().filter(|s| s.compressive.is_some());
        Course {
            sessions: sessions.collect(),
            protocol: scored.arm.protocol,
            measurements: self.measurements.clone(),
            times: self.times,
        }
    }

    /// What may be learned about everything but the object `left_out`.
    fn lessons(&self, scored: &Scored<'_>, left_out: Option<&str>) -> Result<Lessons, LearnError> {
        let arm = scored.arm;
        let (name, sessions) = match &self.learn_from {
            Some((name, sessions)) => (name.as_str(), sessions.as_slice()),
            None => (RASTER, arm.sessions.as_slice()),
        };
        Lessons::from_raster(
            name,
            sessions,
            left_out,
            &arm.protocol,
            arm.cols,
            Streams::new(self.seed),
        )
    }

    fn entries(&self, scored: &Scored<'_>, course: &Course<'_>) -> Result<Vec<Entry>, LearnError> {
        let raster = self.lessons(scored, None)?;
        let given = self.learn_from.is_none() && self.published && scored.published;
        let published = given.then(|| {
            let learned = &scored.arm.learned;
            raster
                .clone()
                .with_published(&learned.dictionary, learned.classifier.library())
        });
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
            let pupil = pupil(Box::new(External::start(command, lessons, k)?), lessons);
            entries.push(entry(command, Needs::Dictionary, lessons, vec![pupil; number]));
        }
        if self.left_out {
            entries.extend(self.left_out_entries(scored, course)?);
        }
        Ok(entries)
    }

    fn left_out_entries(&self, scored: &Scored<'_>, course: &Course<'_>) -> Result<Vec<Entry>, LearnError> {
        let lessons = course
            .sessions
            .iter()
            .map(|s| self.lessons(scored, Some(&s.object)))
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
                Ok(pupil(Box::new(External::start(command, l, number)?), l))
            });
            let pupils = pupils.collect::<Result<Vec<_>, LearnError>>()?;
            entries.push(entry(command, Needs::Dictionary, &lessons[0], pupils));
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
