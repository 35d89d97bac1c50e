//! Trains every algorithm of a board with every source of training data.

use super::BoardSettings;
use crate::algorithm::Contender;
use crate::decoders::{DECODERS, DecoderSpec, Needs, TrainedDecoder};
use crate::labels::Labels;
use crate::sensing::{RowChooser, Sensing};
use crate::session::ScoredSession;
use crate::source::Source;
use crate::training::{
    LAYOUT, PUBLISHED, SHAPES, SkinGains, TrainingData, TrainingPresses, TrainingSource, gain_sds, on_skins_with,
    templates,
};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::{Streams, TaxelGains, VelostatConfig};
use spts_recon::Matrix;
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

impl Entry {
    /// A decoder of the published evaluation, the same for all `sessions`.
    pub(crate) fn published(name: &str, decoder: &TrainedDecoder, sessions: usize) -> Self {
        Self {
            name: name.to_owned(),
            learned_from: PUBLISHED.to_owned(),
            left_out: false,
            sensing: Sensing::Random,
            knows_classes: true,
            decoders: vec![decoder.clone(); sessions],
            choosers: Vec::new(),
        }
    }
}

/// An algorithm of the table or from outside.
#[derive(Clone, Copy)]
enum Algorithm<'a> {
    Own(&'a DecoderSpec),
    External(&'a dyn Contender),
}

/// The scored object, where training depends on it, and whether its raster images are left out.
type Scored<'a> = Option<(&'a str, bool)>;

/// One set of training data.
struct Prepared {
    /// Name of the source, and the scored object.
    key: (String, Option<(String, bool)>),
    data: TrainingData,
    /// Choose rows for this training data, for the mean of its images and for the worst kind; built on request.
    choosers: [Option<Arc<RowChooser>>; 2],
}

/// Trains decoders, each with the training data that it needs; every set of training data is prepared once.
pub(super) struct Trainer<'a> {
    source: &'a Source,
    settings: &'a BoardSettings,
    streams: Streams,
    /// Classes of the scored sessions and of all training data.
    labels: Labels,
    prepared: Vec<Prepared>,
    /// Whether every raster press of the source is scored, so that none may be used for training.
    layout_only: bool,
}

impl<'a> Trainer<'a> {
    pub(super) fn new(source: &'a Source, settings: &'a BoardSettings) -> Self {
        let mut unscored = source.sessions.iter().filter_map(TrainingPresses::unscored);
        Self {
            source,
            settings,
            streams: Streams::new(settings.seed),
            labels: source.labels.clone(),
            prepared: Vec::new(),
            layout_only: unscored.all(|t| t.is_empty()),
        }
    }

    /// The entries of the board, in the order source of training data, learned before left out, algorithm; none twice.
    ///
    /// # Errors
    /// [`Refusal`].
    pub(super) fn entries(&mut self, sessions: &[&ScoredSession]) -> Result<Vec<Entry>, Refusal> {
        let asked = self.settings;
        let own = asked.decoders.iter().map(|spec| Algorithm::Own(spec));
        let external = asked.external.iter().map(|given| Algorithm::External(&**given));
        let algorithms: Vec<Algorithm<'_>> = own.chain(external).collect();
        let mut entries: Vec<Entry> = Vec::new();
        let mut without_classes: Vec<String> = Vec::new();
        for source in &asked.training {
            self.check(source)?;
            for left_out in [false, true] {
                for &algorithm in algorithms.iter().filter(|_| asked.left_out || !left_out) {
                    let (name, needs) = match algorithm {
                        Algorithm::Own(spec) => (spec.name.to_owned(), spec.needs),
                        Algorithm::External(given) => (given.name().to_owned(), Needs::Dictionary),
                    };
                    let source = if needs.shapes() { &TrainingSource::Shapes } else { source };
                    let shapes = matches!(source, TrainingSource::Shapes);
                    // no object is in the shapes, so that all of them are left out
                    if shapes && left_out != asked.left_out {
                        continue;
                    }
                    let published = self.source.published.is_some() && needs == Needs::Dictionary && !left_out;
                    let learned_from = match source {
                        _ if needs == Needs::Nothing => "nothing",
                        TrainingSource::Published if published => PUBLISHED,
                        TrainingSource::Published | TrainingSource::Raster if self.layout_only => LAYOUT,
                        source => source.name(),
                    };
                    let own = matches!(source, TrainingSource::Published | TrainingSource::Raster);
                    let nothing_known = learned_from == LAYOUT || learned_from == SHAPES || own && self.layout_only;
                    if nothing_known && needs == Needs::Classes {
                        if !without_classes.contains(&name) {
                            without_classes.push(name);
                        }
                        continue;
                    }
                    let there = |e: &Entry| e.name == name && e.learned_from == learned_from && e.left_out == left_out;
                    if entries.iter().any(there) {
                        continue;
                    }
                    let published = learned_from == PUBLISHED;
                    let of_object =
                        left_out && !shapes || matches!(source, TrainingSource::Calibrated { gains: None, .. });
                    let mut places = Vec::with_capacity(sessions.len());
                    for session in sessions {
                        let scored = of_object.then_some((session.object.as_str(), left_out));
                        places.push((self.place(source, published, scored)?, scored));
                    }
                    let decoders = places.iter().map(|&(place, scored)| self.decoder(algorithm, place, scored));
                    let decoders = if of_object {
                        decoders.collect::<Result<Vec<_>, Refusal>>()?
                    } else {
                        let one = decoders.take(1).collect::<Result<Vec<_>, Refusal>>()?;
                        one.into_iter().cycle().take(sessions.len()).collect()
                    };
                    for &sensing in &asked.sensing {
                        let choosers = match sensing {
                            Sensing::Random => Vec::new(),
                            Sensing::Chosen | Sensing::WorstKind => {
                                let worst_kind = sensing == Sensing::WorstKind;
                                let each = places.iter().map(|&(place, _)| self.chooser(place, worst_kind));
                                each.collect::<Result<_, Refusal>>()?
                            }
                        };
                        entries.push(Entry {
                            name: name.clone(),
                            learned_from: learned_from.to_owned(),
                            left_out,
                            sensing,
                            knows_classes: !left_out && !nothing_known,
                            decoders: decoders.clone(),
                            choosers,
                        });
                    }
                }
            }
        }
        // a decoder that was named has an entry, or is an error; of all, and of those shown, some may be left out
        let shown = BoardSettings::shown();
        let begins = asked.decoders.iter().zip(&shown).filter(|(asked, shown)| asked.name == shown.name).count();
        let unnamed = begins == shown.len() || asked.decoders.len() == DECODERS.len();
        without_classes.retain(|name| entries.iter().all(|entry| entry.name != *name));
        if !without_classes.is_empty() && (entries.is_empty() || !unnamed) {
            return Err(Refusal::new(format!(
                "`--decoder` = {}: learns classes from raster presses that are not scored, but the sessions have none; \
                 record more raster presses, or use `--learn-from simulation`",
                without_classes.join(", ")
            )));
        }
        Ok(entries)
    }

    /// The published dictionary, or the one that is learned without it.
    pub(super) fn dictionary(&mut self) -> Result<Matrix, Refusal> {
        if let Some(published) = &self.source.published {
            return Ok(published.dictionary.clone());
        }
        let place = self.place(&TrainingSource::Raster, false, None)?;
        Ok(self.prepared[place].data.dictionary()?.atoms.clone())
    }

    /// Refuses recordings of a sheet of another size.
    ///
    /// # Errors
    /// [`Refusal`] with the first of them.
    fn check(&self, source: &TrainingSource) -> Result<(), Refusal> {
        let needed = self.source.layout.taxels();
        let of_session = |s: &ScoredSession| (s.object.clone(), s.raster.as_ref().map_or(needed, Recording::taxels));
        let all: Vec<(String, usize)> = match source {
            TrainingSource::Published | TrainingSource::Raster | TrainingSource::Shapes => Vec::new(),
            TrainingSource::Poses { objects, .. } => {
                objects.iter().map(|o| (o.name.to_owned(), o.images.nrows())).collect()
            }
            TrainingSource::Other { sessions, .. } | TrainingSource::Calibrated { simulated: sessions, .. } => {
                sessions.iter().map(of_session).collect()
            }
        };
        all.iter().find(|(_, taxels)| *taxels != needed).map_or(Ok(()), |(object, taxels)| {
            Err(Refusal::new(format!(
                "{}: the raster session of {object} has {taxels} taxels; the scored skin has {needed}",
                source.name()
            )))
        })
    }

    fn decoder(&self, algorithm: Algorithm<'_>, place: usize, scored: Scored<'_>) -> Result<TrainedDecoder, Refusal> {
        let data = &self.prepared[place].data;
        Ok(match algorithm {
            Algorithm::Own(spec) => TrainedDecoder::new(spec, data)?,
            Algorithm::External(given) => TrainedDecoder::of(given.learn(data, &self.labels, left_out(scored))?, data),
        })
    }

    /// What chooses rows for the set at this place, built once.
    fn chooser(&mut self, place: usize, worst_kind: bool) -> Result<Arc<RowChooser>, Refusal> {
        let Prepared { data, choosers, .. } = &mut self.prepared[place];
        let built = &mut choosers[usize::from(worst_kind)];
        let chooser = match built {
            Some(chooser) => Arc::clone(chooser),
            None => Arc::new(RowChooser::new(data, worst_kind)?),
        };
        *built = Some(Arc::clone(&chooser));
        Ok(chooser)
    }

    /// Place of the training data that may be used for `scored` among those that are prepared.
    fn place(&mut self, source: &TrainingSource, published: bool, scored: Scored<'_>) -> Result<usize, Refusal> {
        let name = match source {
            TrainingSource::Published if published => PUBLISHED,
            source => source.name(),
        };
        let key = (name.to_owned(), scored.map(|(object, left_out)| (object.to_owned(), left_out)));
        if let Some(at) = self.prepared.iter().position(|prepared| prepared.key == key) {
            return Ok(at);
        }
        let mut data = self.prepare(source, scored)?;
        if let (true, Some(given)) = (published, &self.source.published) {
            data = data.with_published(&given.dictionary, &given.library);
        }
        self.prepared.push(Prepared { key, data, choosers: [None, None] });
        Ok(self.prepared.len() - 1)
    }

    fn prepare(&mut self, source: &TrainingSource, scored: Scored<'_>) -> Result<TrainingData, Refusal> {
        let own = self.source;
        match source {
            TrainingSource::Published | TrainingSource::Raster if self.layout_only => {
                TrainingData::for_layout(&own.layout, self.streams)
            }
            TrainingSource::Poses { objects, .. } => {
                let kept = objects.iter().filter(|o| Some(o.name) != left_out(scored));
                let kept: Vec<_> = kept.map(|o| (self.labels.add(o.name), o)).collect();
                TrainingData::of_poses(&kept, own.layout.cols(), self.streams)
            }
            TrainingSource::Shapes => {
                let shapes = TrainingData::for_shapes(&own.layout, self.streams)?;
                Ok(shapes.with_network(self.settings.network.clone()))
            }
            TrainingSource::Published | TrainingSource::Raster => {
                self.learn(&own.sessions, TrainingPresses::unscored, Vec::new(), scored)
            }
            TrainingSource::Other { sessions, gain_sd, all, .. } => {
                let of = if *all { TrainingPresses::all } else { TrainingPresses::unscored };
                let taxels = if *gain_sd > 0.0 { own.layout.taxels() } else { 0 };
                self.learn(sessions, of, vec![*gain_sd; taxels], scored)
            }
            TrainingSource::Calibrated { simulated, gains, .. } => {
                let gains = match gains {
                    Some(gains) => Cow::Borrowed(gains),
                    None => Cow::Owned(self.gains_by_others(simulated, scored)?),
                };
                let streams = self.streams.child("calibrated", 0);
                let shown = on_skins_with(&gains, simulated, streams).map_err(|e| e.at("gains"))?;
                self.learn(&shown, TrainingPresses::all, gain_sds(&gains, &self.source.layout), scored)
            }
        }
    }

    /// Gains of the scored skin, from unscored raster presses of all objects but the scored one.
    fn gains_by_others(&self, simulated: &[ScoredSession], scored: Scored<'_>) -> Result<TaxelGains, Refusal> {
        let others = self.source.sessions.iter();
        let others = others.filter(|s| scored.is_none_or(|(o, _)| s.object != o));
        let skin: Vec<TrainingPresses<'_>> = others.filter_map(TrainingPresses::unscored).collect();
        let twin: Vec<TrainingPresses<'_>> = simulated.iter().filter_map(TrainingPresses::all).collect();
        let of = |presses: &[TrainingPresses<'_>]| templates(presses).map_err(|e| e.at("library"));
        let mounting = VelostatConfig::default().mounting();
        let gains = SkinGains::estimate(&of(&skin)?, &of(&twin)?, &self.source.layout, mounting);
        Ok(gains.map_err(|e| e.at("gains"))?.gains)
    }

    fn learn<'s>(
        &mut self,
        sessions: &'s [ScoredSession],
        training: impl Fn(&'s ScoredSession) -> Option<TrainingPresses<'s>>,
        gain_sd: Vec<f64>,
        scored: Scored<'_>,
    ) -> Result<TrainingData, Refusal> {
        let kept = sessions.iter().filter(|s| Some(s.object.as_str()) != left_out(scored));
        // another source may have numbered its classes otherwise
        let training: Vec<TrainingPresses<'_>> = kept
            .filter_map(|s| Some(training(s)?.labelled(self.labels.add(&s.object))))
            .filter(|t| !t.is_empty())
            .collect();
        TrainingData::new(&training, self.source.layout.cols(), gain_sd, self.streams)
    }
}

/// The object whose raster images are left out.
fn left_out(scored: Scored<'_>) -> Option<&str> {
    scored.filter(|(_, left_out)| *left_out).map(|(object, _)| object)
}
