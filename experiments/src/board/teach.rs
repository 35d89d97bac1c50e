//! Which algorithm learns from where: the entries of a board.

use super::algorithm::Trained;
use super::decoders::{Needs, Spec};
use super::external::{External, ExternalCommand};
use super::lessons::{LearnError, Lessons};
use super::plan::{PUBLISHED, Plan, RASTER};
use super::run::{Entry, Pupil};
use super::source::Source;
use crate::score::Session;
use spts_models::Streams;
use spts_recon::classify::Src;
use std::sync::Arc;

/// Where algorithms learn.
#[derive(Debug, Clone)]
pub enum Teaching {
    /// Dictionary and library as published beside the recordings, where they are; everything else as [`Teaching::Raster`].
    Published,
    /// Raster presses of the scored recordings that are not scored.
    Raster,
    /// Raster presses of other recordings, by name.
    Other(String, Vec<Session>),
}

/// An algorithm of the table or from outside.
#[derive(Clone, Copy)]
enum Pick<'a> {
    Own(&'a Spec),
    External(&'a ExternalCommand),
}

impl Pick<'_> {
    fn name(self) -> String {
        match self {
            Self::Own(spec) => spec.name.to_owned(),
            Self::External(command) => command.name.clone(),
        }
    }

    fn needs(self) -> Needs {
        match self {
            Self::Own(spec) => spec.needs,
            Self::External(_) => Needs::Dictionary,
        }
    }
}

/// Gives lessons, each of them prepared once.
pub(super) struct School<'a> {
    source: &'a Source,
    streams: Streams,
    given: Vec<Lessons>,
    /// External programs started so far.
    programs: usize,
}

impl<'a> School<'a> {
    pub(super) fn new(source: &'a Source, seed: u64) -> Self {
        Self {
            source,
            streams: Streams::new(seed),
            given: Vec::new(),
            programs: 0,
        }
    }

    /// The entries of `plan` for the scored objects, in the order teaching, closed before left out, algorithm; none twice.
    ///
    /// # Errors
    /// [`LearnError`].
    pub(super) fn entries(&mut self, plan: &Plan, objects: &[&str]) -> Result<Vec<Entry>, LearnError> {
        let own = plan.decoders.iter().map(|spec| Pick::Own(spec));
        let picks: Vec<Pick<'_>> = own.chain(plan.external.iter().map(Pick::External)).collect();
        let mut entries: Vec<Entry> = Vec::new();
        for teaching in &plan.teachings {
            for left_out in [false, true] {
                for &pick in picks.iter().filter(|_| plan.left_out || !left_out) {
                    let (name, from) = (pick.name(), self.learned_from(pick.needs(), teaching, left_out));
                    let there = |e: &Entry| e.name == name && e.learned_from == from && e.left_out == left_out;
                    if entries.iter().any(there) {
                        continue;
                    }
                    entries.push(Entry {
                        pupils: self.pupils(pick, teaching, &from, left_out, objects)?,
                        name,
                        learned_from: from,
                        left_out,
                    });
                }
            }
        }
        Ok(entries)
    }

    fn learned_from(&self, needs: Needs, teaching: &Teaching, left_out: bool) -> String {
        let published = self.source.published.is_some() && needs == Needs::Dictionary && !left_out;
        match (needs, teaching) {
            (Needs::Nothing, _) => "nothing".to_owned(),
            (_, Teaching::Published) if published => PUBLISHED.to_owned(),
            (_, Teaching::Published | Teaching::Raster) => RASTER.to_owned(),
            (_, Teaching::Other(name, _)) => name.clone(),
        }
    }

    fn pupils(
        &mut self,
        pick: Pick<'_>,
        teaching: &Teaching,
        from: &str,
        left_out: bool,
        objects: &[&str],
    ) -> Result<Vec<Pupil>, LearnError> {
        let published = from == PUBLISHED;
        if left_out {
            objects
                .iter()
                .map(|object| self.pupil(pick, teaching, published, Some(object)))
                .collect()
        } else {
            let pupil = self.pupil(pick, teaching, published, None)?;
            Ok(vec![pupil; objects.len()])
        }
    }

    fn pupil(
        &mut self,
        pick: Pick<'_>,
        teaching: &Teaching,
        published: bool,
        left_out: Option<&str>,
    ) -> Result<Pupil, LearnError> {
        let program = self.programs;
        let lessons = self.lessons(teaching, published, left_out)?;
        let trained: Box<dyn Trained> = match pick {
            Pick::Own(spec) => (spec.train)(lessons)?,
            Pick::External(command) => Box::new(External::start(&command.command, lessons, program)?),
        };
        let classifier = Src::new(lessons.library.clone(), Src::PUBLISHED_SPARSITY);
        self.programs += 1;
        Ok(Pupil {
            trained: Arc::from(trained),
            classifier: Arc::new(classifier),
        })
    }

    /// What may be learned about everything but the object `left_out`.
    pub(super) fn lessons(
        &mut self,
        teaching: &Teaching,
        published: bool,
        left_out: Option<&str>,
    ) -> Result<&Lessons, LearnError> {
        let (name, sessions, scored) = match teaching {
            Teaching::Published | Teaching::Raster => {
                (RASTER, &self.source.sessions, Some(&self.source.raster_protocol))
            }
            Teaching::Other(name, sessions) => (name.as_str(), sessions, None),
        };
        let source = if published { PUBLISHED } else { name };
        let there = |l: &Lessons| l.source == source && l.left_out.as_deref() == left_out;
        if let Some(at) = self.given.iter().position(there) {
            return Ok(&self.given[at]);
        }
        let mut lessons = Lessons::from_raster(name, sessions, left_out, scored, self.source.cols, self.streams)?;
        if let (true, Some(given)) = (published, &self.source.published) {
            lessons = lessons.with_published(&given.dictionary, &given.library);
        }
        self.given.push(lessons);
        Ok(&self.given[self.given.len() - 1])
    }
}
