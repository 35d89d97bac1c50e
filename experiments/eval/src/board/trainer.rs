//! Trains every algorithm of a board with every source of training data.

use super::run::Entry;
use super::training_sets::{TrainingSets, left_out};
use crate::algorithm::Contender;
use crate::decoders::{DecoderSpec, Needs, TrainedDecoder};
use crate::error::ScoreError;
use crate::sensing::Sensing;
use crate::session::ScoredSession;
use crate::source::Source;
use crate::training::{LAYOUT, PUBLISHED, RASTER, SHAPES, TrainedNetwork, TrainingSource};
use spts_circuit::Recording;
use std::sync::Arc;

/// What is to be trained.
pub(super) struct TrainingRequest<'a> {
    /// Algorithms.
    pub(super) decoders: &'a [&'static DecoderSpec],
    /// External ones.
    pub(super) external: &'a [Arc<dyn Contender>],
    /// Sources of training data, each for every algorithm.
    pub(super) training: &'a [TrainingSource],
    /// Whether every algorithm is also trained without the scored object.
    pub(super) left_out: bool,
    /// Ways to obtain the rows of windows, each for every algorithm.
    pub(super) sensing: &'a [Sensing],
    /// The network for decoders that use one; `None` for the one shipped with the program.
    pub(super) network: Option<&'a TrainedNetwork>,
    /// The scored objects.
    pub(super) objects: &'a [&'a str],
}

/// An algorithm of the table or from outside.
#[derive(Clone, Copy)]
enum Algorithm<'a> {
    Own(&'a DecoderSpec),
    External(&'a dyn Contender),
}

impl Algorithm<'_> {
    fn name(self) -> String {
        match self {
            Self::Own(spec) => spec.name.to_owned(),
            Self::External(given) => given.name().to_owned(),
        }
    }

    fn needs(self) -> Needs {
        match self {
            Self::Own(spec) => spec.needs,
            Self::External(_) => Needs::Dictionary,
        }
    }
}

/// What algorithms learn from.
struct Training<'a> {
    source: &'a TrainingSource,
    /// Whether this is the published dictionary.
    published: bool,
    left_out: bool,
}

/// Training data that are prepared, and the object that they are for, where it matters.
#[derive(Clone, Copy)]
struct At<'a> {
    place: usize,
    scored: Option<(&'a str, bool)>,
}

/// Trains decoders, each with the training data that it needs.
pub(super) struct Trainer<'a> {
    source: &'a Source,
    pub(super) sets: TrainingSets<'a>,
}

impl<'a> Trainer<'a> {
    pub(super) fn new(source: &'a Source, seed: u64) -> Self {
        Self {
            source,
            sets: TrainingSets::new(source, seed),
        }
    }

    /// The entries of the board, in the order source of training data, learned before left out, algorithm; none twice.
    ///
    /// # Errors
    /// [`ScoreError`].
    pub(super) fn entries(&mut self, asked: &TrainingRequest<'_>) -> Result<Vec<Entry>, ScoreError> {
        let own = asked.decoders.iter().map(|spec| Algorithm::Own(spec));
        let algorithms: Vec<Algorithm<'_>> = own
            .chain(asked.external.iter().map(|given| Algorithm::External(&**given)))
            .collect();
        let mut entries: Vec<Entry> = Vec::new();
        let mut without_classes: Vec<String> = Vec::new();
        self.sets.network = asked.network.cloned();
        for source in asked.training {
            self.check(source)?;
            for left_out in [false, true] {
                for &algorithm in algorithms.iter().filter(|_| asked.left_out || !left_out) {
                    let shapes = TrainingSource::Shapes;
                    let source = if algorithm.needs().shapes() { &shapes } else { source };
                    // no object is in the shapes, so that all of them are left out
                    if matches!(source, TrainingSource::Shapes) && left_out != asked.left_out {
                        continue;
                    }
                    let (name, from) = (algorithm.name(), self.learned_from(algorithm.needs(), source, left_out));
                    let there = |e: &Entry| e.name == name && e.learned_from == from && e.left_out == left_out;
                    let nothing_known = from == LAYOUT || from == SHAPES;
                    let no_classes = nothing_known && algorithm.needs() == Needs::Classes;
                    if no_classes {
                        if !without_classes.contains(&name) {
                            without_classes.push(name);
                        }
                        continue;
                    }
                    if entries.iter().any(there) {
                        continue;
                    }
                    let training = Training {
                        source,
                        published: from == PUBLISHED,
                        left_out,
                    };
                    let decoders = self.each(&training, asked.objects, |own, at| own.decoder(algorithm, at))?;
                    for &sensing in asked.sensing {
                        let chooser = |own: &mut Self, at: At<'_>| Ok(own.sets.chooser(at.place)?);
                        entries.push(Entry {
                            name: name.clone(),
                            learned_from: from.clone(),
                            left_out,
                            sensing,
                            knows_classes: !left_out && !nothing_known,
                            decoders: decoders.clone(),
                            choosers: match sensing {
                                Sensing::Random => Vec::new(),
                                Sensing::Chosen => self.each(&training, asked.objects, chooser)?,
                            },
                        });
                    }
                }
            }
        }
        if entries.is_empty() && !without_classes.is_empty() {
            return Err(ScoreError::NoClasses {
                decoders: without_classes.join(", "),
            });
        }
        Ok(entries)
    }

    /// Refuses recordings of a sheet of another size.
    ///
    /// # Errors
    /// [`ScoreError::Taxels`].
    fn check(&self, source: &TrainingSource) -> Result<(), ScoreError> {
        let (name, sessions) = match source {
            TrainingSource::Published | TrainingSource::Raster | TrainingSource::Shapes => return Ok(()),
            TrainingSource::Poses { name, objects } => {
                let needed = self.source.layout.taxels();
                return match objects.iter().find(|o| o.images.nrows() != needed) {
                    None => Ok(()),
                    Some(other) => Err(ScoreError::Taxels {
                        name: name.clone(),
                        object: other.name.to_owned(),
                        taxels: other.images.nrows(),
                        needed,
                    }),
                };
            }
            TrainingSource::Other { name, sessions, .. } => (name.as_str(), sessions),
            TrainingSource::Calibrated { name, simulated, .. } => (name.as_str(), simulated),
        };
        let needed = self.source.layout.taxels();
        let taxels = |s: &ScoredSession| s.raster.as_ref().map_or(needed, Recording::taxels);
        match sessions.iter().find(|s| taxels(s) != needed) {
            None => Ok(()),
            Some(other) => Err(ScoreError::Taxels {
                name: name.to_owned(),
                object: other.object.clone(),
                taxels: taxels(other),
                needed,
            }),
        }
    }

    fn learned_from(&self, needs: Needs, source: &TrainingSource, left_out: bool) -> String {
        let published = self.source.published.is_some() && needs == Needs::Dictionary && !left_out;
        match (needs, source) {
            (Needs::Nothing, _) => "nothing".to_owned(),
            (_, TrainingSource::Published) if published => PUBLISHED.to_owned(),
            (_, TrainingSource::Published | TrainingSource::Raster) if self.sets.layout_only => LAYOUT.to_owned(),
            (_, TrainingSource::Published | TrainingSource::Raster) => RASTER.to_owned(),
            (
                _,
                TrainingSource::Other { name, .. }
                | TrainingSource::Poses { name, .. }
                | TrainingSource::Calibrated { name, .. },
            ) => name.clone(),
            (_, TrainingSource::Shapes) => SHAPES.to_owned(),
        }
    }

    /// One of what `make` makes for a scored object; one for all where they learn from the same.
    fn each<T: Clone>(
        &mut self,
        training: &Training<'_>,
        objects: &[&str],
        make: impl Fn(&mut Self, At<'_>) -> Result<T, ScoreError>,
    ) -> Result<Vec<T>, ScoreError> {
        let mut made = |scored| {
            let place = self.sets.place(training.source, training.published, scored)?;
            make(self, At { place, scored })
        };
        let shapes = matches!(training.source, TrainingSource::Shapes);
        if !shapes && training.left_out || matches!(training.source, TrainingSource::Calibrated { gains: None, .. }) {
            let each = objects.iter();
            each.map(|object| made(Some((object, training.left_out)))).collect()
        } else {
            Ok(vec![made(None)?; objects.len()])
        }
    }

    fn decoder(&self, algorithm: Algorithm<'_>, at: At<'_>) -> Result<TrainedDecoder, ScoreError> {
        let data = self.sets.at(at.place);
        Ok(match algorithm {
            Algorithm::Own(spec) => TrainedDecoder::new(spec, data)?,
            Algorithm::External(given) => {
                TrainedDecoder::of(given.learn(data, &self.sets.labels, left_out(at.scored))?, data)
            }
        })
    }
}
