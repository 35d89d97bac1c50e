//! Which algorithm learns from where: the entries of a board.

use super::algorithm::Trained;
use super::decoders::{Needs, Spec};
use super::external::{External, ExternalCommand};
use super::plan::{BoardError, LAYOUT, PUBLISHED, Plan, RASTER};
use super::run::{Entry, Pupil};
use crate::learn::{GainMap, LearnError, Lessons, TrainingPresses, templates};
use crate::score::ScoredSession;
use crate::source::Source;
use spts_circuit::Recording;
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
    /// Raster presses of other recordings.
    Other {
        /// Name on the board.
        name: String,
        /// The recordings.
        sessions: Vec<ScoredSession>,
        /// Whether all presses are learned from, as of a twin; of a real skin, those that are scored on the board are not: it may be
        /// the scored one.
        all: bool,
        /// γ: relative standard deviation of the gains between that skin and the scored one; 0 for the same skin.
        gain_sd: f64,
    },
    /// Simulated raster presses with the gains of the scored skin, which unscored raster presses of all objects but the scored one tell.
    Calibrated(Vec<ScoredSession>),
}

/// Name of [`Teaching::Calibrated`].
pub const CALIBRATED: &str = "calibrated";

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

/// Source, object that is not to be known of, and whether it is kept out of the lessons, too.
#[derive(PartialEq, Eq)]
struct Key(String, Option<String>, bool);

/// Gives lessons, each of them prepared once.
pub(super) struct School<'a> {
    source: &'a Source,
    streams: Streams,
    given: Vec<(Key, Lessons)>,
    /// Whether every raster press of the source is scored, so that none may be learned from.
    untaught: bool,
}

impl<'a> School<'a> {
    pub(super) fn new(source: &'a Source, seed: u64) -> Self {
        Self {
            source,
            streams: Streams::new(seed),
            given: Vec::new(),
            untaught: source
                .sessions
                .iter()
                .filter_map(TrainingPresses::unscored)
                .all(|t| t.is_empty()),
        }
    }

    /// The entries of `plan` for the scored objects, in the order teaching, closed before left out, algorithm; none twice.
    ///
    /// # Errors
    /// [`BoardError`].
    pub(super) fn entries(&mut self, plan: &Plan, objects: &[&str]) -> Result<Vec<Entry>, BoardError> {
        let own = plan.decoders.iter().map(|spec| Pick::Own(spec));
        let picks: Vec<Pick<'_>> = own.chain(plan.external.iter().map(Pick::External)).collect();
        let mut entries: Vec<Entry> = Vec::new();
        for teaching in &plan.teachings {
            self.check(teaching)?;
            for left_out in [false, true] {
                for &pick in picks.iter().filter(|_| plan.left_out || !left_out) {
                    let (name, from) = (pick.name(), self.learned_from(pick.needs(), teaching, left_out));
                    let there = |e: &Entry| e.name == name && e.learned_from == from && e.left_out == left_out;
                    let no_classes = from == LAYOUT && pick.needs() == Needs::Classes;
                    if no_classes || entries.iter().any(there) {
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

    /// Refuses recordings of a sheet of another size.
    ///
    /// # Errors
    /// [`BoardError::Taxels`].
    fn check(&self, teaching: &Teaching) -> Result<(), BoardError> {
        let (name, sessions) = match teaching {
            Teaching::Published | Teaching::Raster => return Ok(()),
            Teaching::Other { name, sessions, .. } => (name.as_str(), sessions),
            Teaching::Calibrated(sessions) => (CALIBRATED, sessions),
        };
        let needed = self.source.layout.taxels();
        let taxels = |s: &ScoredSession| s.raster.as_ref().map_or(needed, Recording::taxels);
        match sessions.iter().find(|s| taxels(s) != needed) {
            None => Ok(()),
            Some(other) => Err(BoardError::Taxels {
                name: name.to_owned(),
                object: other.object.clone(),
                taxels: taxels(other),
                needed,
            }),
        }
    }

    fn learned_from(&self, needs: Needs, teaching: &Teaching, left_out: bool) -> String {
        let published = self.source.published.is_some() && needs == Needs::Dictionary && !left_out;
        match (needs, teaching) {
            (Needs::Nothing, _) => "nothing".to_owned(),
            (_, Teaching::Published) if published => PUBLISHED.to_owned(),
            (_, Teaching::Published | Teaching::Raster) if self.untaught => LAYOUT.to_owned(),
            (_, Teaching::Published | Teaching::Raster) => RASTER.to_owned(),
            (_, Teaching::Other { name, .. }) => name.clone(),
            (_, Teaching::Calibrated(_)) => CALIBRATED.to_owned(),
        }
    }

    fn pupils(
        &mut self,
        pick: Pick<'_>,
        teaching: &Teaching,
        from: &str,
        left_out: bool,
        objects: &[&str],
    ) -> Result<Vec<Pupil>, BoardError> {
        let published = from == PUBLISHED;
        if left_out || matches!(teaching, Teaching::Calibrated(_)) {
            let each = objects.iter();
            each.map(|object| self.pupil(pick, teaching, published, Some((object, left_out))))
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
        scored: Option<(&str, bool)>,
    ) -> Result<Pupil, BoardError> {
        let left_out = scored.filter(|(_, left_out)| *left_out).map(|(object, _)| object);
        let lessons = self.lessons(teaching, published, scored)?;
        let trained: Box<dyn Trained> = match pick {
            Pick::Own(spec) => (spec.train)(lessons)?,
            Pick::External(command) => Box::new(External::start(&command.command, lessons, left_out)?),
        };
        let classifier = Src::new(lessons.library.clone(), Src::PUBLISHED_SPARSITY);
        Ok(Pupil {
            trained: Arc::from(trained),
            classifier: Arc::new(classifier),
        })
    }

    /// What may be learned when `scored` is the object, which may be left out.
    pub(super) fn lessons(
        &mut self,
        teaching: &Teaching,
        published: bool,
        scored: Option<(&str, bool)>,
    ) -> Result<&Lessons, LearnError> {
        let name = match teaching {
            Teaching::Published if published => PUBLISHED,
            Teaching::Published | Teaching::Raster => RASTER,
            Teaching::Other { name, .. } => name,
            Teaching::Calibrated(_) => CALIBRATED,
        };
        let left_out = scored.is_some_and(|(_, left_out)| left_out);
        let key = Key(name.to_owned(), scored.map(|(object, _)| object.to_owned()), left_out);
        if let Some(at) = self.given.iter().position(|(k, _)| *k == key) {
            return Ok(&self.given[at].1);
        }
        let mut lessons = self.prepare(teaching, scored)?;
        if let (true, Some(given)) = (published, &self.source.published) {
            lessons = lessons.with_published(&given.dictionary, &given.library);
        }
        self.given.push((key, lessons));
        Ok(&self.given[self.given.len() - 1].1)
    }

    fn prepare(&self, teaching: &Teaching, scored: Option<(&str, bool)>) -> Result<Lessons, LearnError> {
        let source = self.source;
        match teaching {
            Teaching::Published | Teaching::Raster if self.untaught => {
                Lessons::for_layout(&source.layout, self.streams)
            }
            Teaching::Published | Teaching::Raster => {
                self.learn(&source.sessions, TrainingPresses::unscored, 0.0, scored)
            }
            Teaching::Other {
                sessions,
                gain_sd,
                all: true,
                ..
            } => self.learn(sessions, TrainingPresses::all, *gain_sd, scored),
            Teaching::Other { sessions, gain_sd, .. } => {
                self.learn(sessions, TrainingPresses::unscored, *gain_sd, scored)
            }
            Teaching::Calibrated(simulated) => {
                let others = source
                    .sessions
                    .iter()
                    .filter(|s| scored.is_none_or(|(o, _)| s.object != o));
                let skin: Vec<TrainingPresses<'_>> = others.filter_map(TrainingPresses::unscored).collect();
                let twin: Vec<TrainingPresses<'_>> = simulated.iter().filter_map(TrainingPresses::all).collect();
                let gains = GainMap::estimate(&templates(&skin)?, &templates(&twin)?)?;
                self.learn(
                    &gains.applied(simulated)?,
                    TrainingPresses::all,
                    gains.gain_sd(),
                    scored,
                )
            }
        }
    }

    fn learn<'s>(
        &self,
        sessions: &'s [ScoredSession],
        training: impl Fn(&'s ScoredSession) -> Option<TrainingPresses<'s>>,
        gain_sd: f64,
        scored: Option<(&str, bool)>,
    ) -> Result<Lessons, LearnError> {
        let left_out = scored.filter(|(_, left_out)| *left_out).map(|(object, _)| object);
        let kept = sessions.iter().filter(|s| Some(s.object.as_str()) != left_out);
        let training: Vec<TrainingPresses<'_>> = kept.filter_map(training).filter(|t| !t.is_empty()).collect();
        Lessons::new(&training, self.source.layout.cols(), gain_sd, self.streams)
    }
}
