//! The whole comparison: recordings in, numbers and curves out.

use super::statistics::{not_modelled, statistics};
use super::{
    ComparedSession, CurveDistance, ReplayError, ScoreCurves, Statistic, compare_all, curves, curves_steps, text,
};
use crate::calibrate::SessionPair;
use serde::{Serialize, Serializer};
use spts::progress::Progress;
use spts_eval::{PublishedSkin, ScoreError};
use spts_models::Streams;
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

/// What is compared.
#[derive(Debug, Clone, Copy)]
pub struct CompareStudy<'a> {
    /// Directory that the sessions were read from.
    pub recordings: &'a Path,
    /// Its sessions.
    pub pairs: &'a [SessionPair],
    /// What the presses are scored with; without it there are no score curves.
    pub real: Option<&'a PublishedSkin>,
    /// Root of the twin's random numbers.
    pub seed: u64,
}

/// What a comparison found.
#[derive(Debug, Clone, Serialize)]
pub struct CompareReport {
    /// Sessions.
    #[serde(skip)]
    pub compared: Vec<ComparedSession>,
    /// Numbers that must agree.
    pub statistics: Vec<Statistic>,
    /// Score curves, if they were asked for. Their distances alone are serialised.
    #[serde(serialize_with = "distances_only")]
    pub curves: Option<ScoreCurves>,
    /// Numbers that the readout does not model.
    pub not_modelled: Vec<Statistic>,
}

fn distances_only<S: Serializer>(curves: &Option<ScoreCurves>, serializer: S) -> Result<S::Ok, S::Error> {
    distances(curves.as_ref()).serialize(serializer)
}

fn distances(curves: Option<&ScoreCurves>) -> &[CurveDistance] {
    curves.map_or(&[], |c| &c.distances)
}

impl CompareStudy<'_> {
    /// Calibrates and replays every session, and scores them when it is known with what.
    ///
    /// # Errors
    /// [`CompareError`] when a session cannot be compared.
    pub fn run(&self, progress: &dyn Progress) -> Result<CompareReport, CompareError> {
        progress.stage("replaying sessions", Some(self.pairs.len()));
        let compared = compare_all(self.pairs, Streams::new(self.seed), &|| progress.step()).map_err(|source| {
            CompareError::Replay {
                recordings: self.recordings.to_owned(),
                source,
            }
        })?;
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
            curves,
        })
    }
}

impl CompareReport {
    /// Both kinds of numbers.
    #[must_use]
    pub fn all_statistics(&self) -> Vec<Statistic> {
        [self.statistics.as_slice(), &self.not_modelled].concat()
    }

    /// Distances of the score curves; none without curves.
    #[must_use]
    pub fn distances(&self) -> &[CurveDistance] {
        distances(self.curves.as_ref())
    }

    /// The numbers and the distances of the curves as tables to read.
    #[must_use]
    pub fn text(&self) -> String {
        text::table(self)
    }
}
