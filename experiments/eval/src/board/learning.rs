//! Trains every algorithm of a board with every source of training data.

use crate::algorithm::{Contender, ScoreError};
use crate::decoders::{DecoderSpec, Needs, TrainedDecoder};
use crate::labels::Labels;
use crate::sensing::{RowChooser, Sensing};
use crate::session::ScoredSession;
use crate::source::Source;
use crate::training::{
    LAYOUT, LearnError, PUBLISHED, RASTER, SHAPES, SkinGains, TrainedNetwork, TrainingData, TrainingPresses,
    TrainingSource, gain_sds, in_gains, in_library, on_skins_with, templates,
};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::{Streams, TaxelGains, VelostatConfig};
use std::borrow::Cow;
use std::sync::Arc;

/// One line of the board before it is scored.
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) learned_from: String,
    pub(crate) left_out: bool,
    pub(crate) sensing: Sensing,
    /// Whether the scored classes are in the training data, so that classes are scored.
    pub(crate) knows_classes: bool,
    /// One decoder for each scored session.
    pub(crate) decoders: Vec<TrainedDecoder>,
    /// One row chooser for each scored session; empty for consecutive measurements.
    pub(crate) choosers: Vec<Arc<RowChooser>>,
}

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
            return Err(Refusal::new(format!(
                "`--decoder` = {}: learns classes from raster presses that are not scored, but the sessions have none; \
                 record more raster presses, or use `--learn-from simulation`",
                without_classes.join(", ")
            ))
            .into());
        }
        Ok(entries)
    }

    /// Refuses recordings of a sheet of another size.
    ///
    /// # Errors
    /// [`Refusal`] with the first of them.
    fn check(&self, source: &TrainingSource) -> Result<(), Refusal> {
        let needed = self.source.layout.taxels();
        let taxels = |s: &ScoredSession| s.raster.as_ref().map_or(needed, Recording::taxels);
        let other = |sessions: &[ScoredSession]| {
            let other = sessions.iter().find(|s| taxels(s) != needed)?;
            Some((other.object.clone(), taxels(other)))
        };
        let (name, other) = match source {
            TrainingSource::Published | TrainingSource::Raster | TrainingSource::Shapes => return Ok(()),
            TrainingSource::Poses { name, objects } => {
                let other = objects.iter().find(|o| o.images.nrows() != needed);
                (name, other.map(|o| (o.name.to_owned(), o.images.nrows())))
            }
            TrainingSource::Other { name, sessions, .. } => (name, other(sessions)),
            TrainingSource::Calibrated { name, simulated, .. } => (name, other(simulated)),
        };
        other.map_or(Ok(()), |(object, taxels)| {
            Err(Refusal::new(format!(
                "{name}: the raster session of {object} has {taxels} taxels; the scored skin has {needed}"
            )))
        })
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

/// What one set of training data is for.
#[derive(Debug, Clone, PartialEq, Eq)]
struct TrainingKey {
    /// Name of the source.
    source: String,
    /// The scored object, if the training depends on it.
    object: Option<String>,
    /// Whether this object is excluded from the training data.
    left_out: bool,
}

/// One set of training data.
struct Prepared {
    key: TrainingKey,
    data: TrainingData,
    /// Chooses rows for this training data; built on request.
    chooser: Option<Arc<RowChooser>>,
}

/// Sets of training data, prepared on request.
pub(super) struct TrainingSets<'a> {
    source: &'a Source,
    streams: Streams,
    /// Classes of the scored sessions and of all training data.
    pub(super) labels: Labels,
    prepared: Vec<Prepared>,
    /// Whether every raster press of the source is scored, so that none may be used for training.
    pub(super) layout_only: bool,
    /// The network for decoders that use one; `None` for the one shipped with the program.
    pub(super) network: Option<TrainedNetwork>,
}

impl<'a> TrainingSets<'a> {
    /// None prepared yet.
    pub(super) fn new(source: &'a Source, seed: u64) -> Self {
        Self {
            source,
            streams: Streams::new(seed),
            labels: source.labels.clone(),
            prepared: Vec::new(),
            network: None,
            layout_only: source
                .sessions
                .iter()
                .filter_map(TrainingPresses::unscored)
                .all(|t| t.is_empty()),
        }
    }

    /// The set at a place that [`Self::place`] gave.
    pub(super) fn at(&self, place: usize) -> &TrainingData {
        &self.prepared[place].data
    }

    /// What chooses rows for the set at this place, built once.
    pub(super) fn chooser(&mut self, place: usize) -> Result<Arc<RowChooser>, LearnError> {
        let prepared = &mut self.prepared[place];
        if let Some(chooser) = &prepared.chooser {
            return Ok(Arc::clone(chooser));
        }
        let chooser = Arc::new(RowChooser::new(&prepared.data)?);
        prepared.chooser = Some(Arc::clone(&chooser));
        Ok(chooser)
    }

    /// What may be learned when `scored` is the object; with `true` beside it, its raster images are left out.
    pub(super) fn data(
        &mut self,
        source: &TrainingSource,
        published: bool,
        scored: Option<(&str, bool)>,
    ) -> Result<&TrainingData, LearnError> {
        let at = self.place(source, published, scored)?;
        Ok(&self.prepared[at].data)
    }

    /// Place of this training data among those that are prepared; see [`Self::data`].
    pub(super) fn place(
        &mut self,
        source: &TrainingSource,
        published: bool,
        scored: Option<(&str, bool)>,
    ) -> Result<usize, LearnError> {
        let name = match source {
            TrainingSource::Published if published => PUBLISHED,
            TrainingSource::Published | TrainingSource::Raster => RASTER,
            TrainingSource::Other { name, .. }
            | TrainingSource::Poses { name, .. }
            | TrainingSource::Calibrated { name, .. } => name,
            TrainingSource::Shapes => SHAPES,
        };
        let key = TrainingKey {
            source: name.to_owned(),
            object: scored.map(|(object, _)| object.to_owned()),
            left_out: left_out(scored).is_some(),
        };
        if let Some(at) = self.prepared.iter().position(|prepared| prepared.key == key) {
            return Ok(at);
        }
        let mut data = self.prepare(source, scored)?;
        if let (true, Some(given)) = (published, &self.source.published) {
            data = data.with_published(&given.dictionary, &given.library);
        }
        self.prepared.push(Prepared {
            key,
            data,
            chooser: None,
        });
        Ok(self.prepared.len() - 1)
    }

    fn prepare(&mut self, source: &TrainingSource, scored: Option<(&str, bool)>) -> Result<TrainingData, LearnError> {
        let own = self.source;
        match source {
            TrainingSource::Published | TrainingSource::Raster if self.layout_only => {
                TrainingData::for_layout(&own.layout, self.streams)
            }
            TrainingSource::Poses { objects, .. } => {
                let left_out = left_out(scored);
                let kept = objects.iter().filter(|o| Some(o.name) != left_out);
                let kept: Vec<_> = kept.map(|o| (self.labels.add(o.name), o)).collect();
                TrainingData::of_poses(&kept, own.layout.cols(), self.streams)
            }
            TrainingSource::Shapes => {
                Ok(TrainingData::for_shapes(&own.layout, self.streams)?.with_network(self.network.clone()))
            }
            TrainingSource::Published | TrainingSource::Raster => {
                self.learn(&own.sessions, TrainingPresses::unscored, Vec::new(), scored)
            }
            TrainingSource::Other {
                sessions,
                gain_sd,
                all: true,
                ..
            } => self.learn(sessions, TrainingPresses::all, self.same_for_all(*gain_sd), scored),
            TrainingSource::Other { sessions, gain_sd, .. } => {
                self.learn(sessions, TrainingPresses::unscored, self.same_for_all(*gain_sd), scored)
            }
            TrainingSource::Calibrated { simulated, gains, .. } => {
                let gains = match gains {
                    Some(gains) => Cow::Borrowed(gains),
                    None => Cow::Owned(self.gains_by_others(simulated, scored)?),
                };
                let shown = on_skins_with(&gains, simulated, self.streams.child("calibrated", 0)).map_err(in_gains)?;
                self.learn(&shown, TrainingPresses::all, gain_sds(&gains), scored)
            }
        }
    }

    /// Gains of the scored skin, from unscored raster presses of all objects but the scored one.
    fn gains_by_others(
        &self,
        simulated: &[ScoredSession],
        scored: Option<(&str, bool)>,
    ) -> Result<TaxelGains, LearnError> {
        let others = self.source.sessions.iter();
        let others = others.filter(|s| scored.is_none_or(|(o, _)| s.object != o));
        let skin: Vec<TrainingPresses<'_>> = others.filter_map(TrainingPresses::unscored).collect();
        let twin: Vec<TrainingPresses<'_>> = simulated.iter().filter_map(TrainingPresses::all).collect();
        let mounting = VelostatConfig::default().session_log_sd;
        let [skin, twin] = [templates(&skin), templates(&twin)];
        let gains = SkinGains::estimate(&skin.map_err(in_library)?, &twin.map_err(in_library)?, mounting);
        Ok(gains.map_err(in_gains)?.gains)
    }

    /// The same γ for every taxel.
    fn same_for_all(&self, gain_sd: f64) -> Vec<f64> {
        if gain_sd > 0.0 {
            vec![gain_sd; self.source.layout.taxels()]
        } else {
            Vec::new()
        }
    }

    fn learn<'s>(
        &mut self,
        sessions: &'s [ScoredSession],
        training: impl Fn(&'s ScoredSession) -> Option<TrainingPresses<'s>>,
        gain_sd: Vec<f64>,
        scored: Option<(&str, bool)>,
    ) -> Result<TrainingData, LearnError> {
        let left_out = left_out(scored);
        let kept = sessions.iter().filter(|s| Some(s.object.as_str()) != left_out);
        // another source may have numbered its classes otherwise
        let training: Vec<TrainingPresses<'_>> = kept
            .filter_map(|s| Some(training(s)?.labelled(self.labels.add(&s.object))))
            .filter(|t| !t.is_empty())
            .collect();
        TrainingData::new(&training, self.source.layout.cols(), gain_sd, self.streams)
    }
}

/// The object whose raster images are left out.
pub(super) fn left_out(scored: Option<(&str, bool)>) -> Option<&str> {
    scored.filter(|(_, left_out)| *left_out).map(|(object, _)| object)
}
