//! The whole comparison: from recordings to statistics and curves.

use super::predicted::{PredictedStatistic, Prediction, predicted_statistics};
use super::statistics::{not_modelled, statistics};
use super::{
    ComparedSession, CurveDistance, ReplayError, ScoreCurves, Statistic, compare_all, curves, curves_steps, text,
};
use crate::calibrate::SessionPair;
use serde::{Serialize, Serializer};
use spts::progress::Progress;
use spts_eval::{PublishedSkin, ScoreError};
use spts_models::{Streams, TaxelGains};
use std::path::{Path, PathBuf};

/// Why the twin cannot be compared with recordings.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A session cannot be replayed.
    #[error("{}: {source}", recordings.display())]
    Replay {
        /// Directory of the recordings.
        recordings: PathBuf,
        /// Cause.
        source: ReplayError,
    },
    /// The sessions cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
}

/// The images that the twin's readout is given.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Images {
    /// Those measured on the skin.
    #[default]
    Recorded,
    /// Those of the simulation: the same object on a simulated skin.
    Simulated {
        /// Gains of that skin; `None` for an arbitrary skin.
        gains: Option<TaxelGains>,
    },
}

/// Settings of `spts compare`, which compares the twin's recordings with those of the real skin.
#[derive(Debug, Clone)]
pub struct CompareStudy<'a> {
    /// Folder from which the sessions were read.
    pub recordings: &'a Path,
    /// Its sessions.
    pub pairs: &'a [SessionPair],
    /// What is needed for scoring; without it there are no score curves.
    pub real: Option<&'a PublishedSkin>,
    /// The images for the twin.
    pub images: Images,
    /// Predicts every session with a profile fitted to others, instead of calibrating on its own odd presses.
    pub prediction: Option<Prediction>,
    /// Seed of the twin's random numbers.
    pub seed: u64,
}

/// Results of `spts compare`: statistics and score curves of the twin beside those of the real skin.
#[derive(Debug, Clone, Serialize)]
pub struct CompareReport {
    /// Sessions.
    #[serde(skip)]
    pub compared: Vec<ComparedSession>,
    /// Statistics that must agree.
    pub statistics: Vec<Statistic>,
    /// Score curves, if requested. Only their distances are serialised.
    #[serde(serialize_with = "distances_only")]
    pub curves: Option<ScoreCurves>,
    /// Statistics compared with the band of a profile fitted to others, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub predicted: Vec<PredictedStatistic>,
    /// Statistics of effects that the readout does not model.
    pub not_modelled: Vec<Statistic>,
}

fn distances_only<S: Serializer>(curves: &Option<ScoreCurves>, serializer: S) -> Result<S::Ok, S::Error> {
    distances(curves.as_ref()).serialize(serializer)
}

fn distances(curves: Option<&ScoreCurves>) -> &[CurveDistance] {
    curves.map_or(&[], |c| &c.distances)
}

impl CompareStudy<'_> {
    /// Calibrates and replays every session, and scores it if the published dictionary and library are given.
    ///
    /// # Errors
    /// [`CompareError`] if a session cannot be compared.
    pub fn run(&self, progress: &dyn Progress) -> Result<CompareReport, CompareError> {
        if let Some(prediction) = &self.prediction {
            #[expect(clippy::cast_possible_truncation, reason = "at most 1000 draws")]
            let twins = self.pairs.len() * prediction.draws as usize;
            progress.stage("predicting sessions", Some(twins));
            let streams = Streams::new(self.seed);
            let predicted = predicted_statistics(self.pairs, prediction, &self.images, streams, &|| progress.step());
            progress.end();
            return Ok(CompareReport {
                compared: Vec::new(),
                statistics: Vec::new(),
                curves: None,
                predicted: predicted.map_err(|source| self.replay(source))?,
                not_modelled: Vec::new(),
            });
        }
        progress.stage("replaying sessions", Some(self.pairs.len()));
        let compared = compare_all(self.pairs, &self.images, Streams::new(self.seed), &|| progress.step());
        let compared = compared.map_err(|source| self.replay(source))?;
        progress.end();
        let scored = self.real.map(|real| {
            progress.stage("scoring presses", Some(curves_steps(&compared, real)));
            let scored = curves(&compared, real, &|| progress.step());
            progress.end();
            scored
        });
        let curves = scored.transpose()?;
        Ok(CompareReport {
            statistics: statistics(&compared),
            not_modelled: not_modelled(&compared),
            compared,
            predicted: Vec::new(),
            curves,
        })
    }

    fn replay(&self, source: ReplayError) -> CompareError {
        CompareError::Replay {
            recordings: self.recordings.to_owned(),
            source,
        }
    }
}

impl CompareReport {
    /// Statistics of both kinds.
    #[must_use]
    pub fn all_statistics(&self) -> Vec<Statistic> {
        [self.statistics.as_slice(), &self.not_modelled].concat()
    }

    /// Distances of the score curves; empty without curves.
    #[must_use]
    pub fn distances(&self) -> &[CurveDistance] {
        distances(self.curves.as_ref())
    }

    /// Statistics and distances of the curves as text tables.
    #[must_use]
    pub fn text(&self) -> String {
        text::table(self)
    }
}
