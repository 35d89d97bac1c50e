//! The training data of a board, each set prepared once.

use crate::labels::Labels;
use crate::sensing::RowChooser;
use crate::session::ScoredSession;
use crate::source::Source;
use crate::training::{
    LearnError, PUBLISHED, RASTER, SHAPES, SkinGains, TrainedNetwork, TrainingData, TrainingPresses, TrainingSource,
    gain_sds, in_gains, in_library, on_skins_with, templates,
};
use spts_models::{Streams, TaxelGains, VelostatConfig};
use std::borrow::Cow;
use std::sync::Arc;

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
        Ok(SkinGains::estimate(
            &templates(&skin).map_err(in_library)?,
            &templates(&twin).map_err(in_library)?,
            mounting,
        )?
        .gains)
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
