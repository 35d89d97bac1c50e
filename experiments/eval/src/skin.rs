//! The published evaluation of a skin.

use crate::baselines::{BaselineRow, baselines};
use crate::control::score_raster;
use crate::decoders::{PublishedDecode, TrainedDecoder};
use crate::error::ScoreError;
use crate::place::{LocalisationRow, PlaceRow, localise, places};
use crate::sensing::Sensing;
use crate::session::ScoredSession;
use crate::training::Learned;
use crate::validation::{ScoreRow, mean_rows, score_session};
use serde::Serialize;
use spts_circuit::Recording;

/// Everything on which a skin, real or simulated, is scored.
#[derive(Debug, Clone)]
pub struct ScoredSkin {
    /// Sessions of the objects.
    pub sessions: Vec<ScoredSession>,
    /// Recording of the bouncing ball.
    pub bounces: Option<Recording>,
    /// Training results of the published decoder.
    pub learned: Learned,
}

/// Scores of one skin by the published evaluation: what `spts validate` prints.
#[derive(Debug, Clone, Serialize)]
pub struct SkinScores {
    /// For every object, and for the mean over all objects (named "mean").
    pub rows: Vec<ScoreRow>,
    /// Localisation of the bouncing ball.
    pub localisation: Vec<LocalisationRow>,
    /// Trivial baselines.
    pub baselines: Vec<BaselineRow>,
}

impl ScoredSkin {
    /// Number of progress reports of [`ScoredSkin::score`].
    #[must_use]
    pub fn steps(&self) -> usize {
        self.sessions.iter().map(|s| s.scored().len() + 1).sum()
    }

    /// Scores the skin at every M of `measurements` by the published decodes and by the decoders in `more`, each beside
    /// its name, and the ball's place at every M of `localisation`; `done` is called after every press and every raster
    /// recording.
    ///
    /// # Errors
    /// [`ScoreError`] if the trained dictionary or library does not fit the skin.
    pub fn score(
        &self,
        measurements: &[usize],
        localisation: &[usize],
        more: &[(&'static str, TrainedDecoder)],
        done: &(dyn Fn() + Sync),
    ) -> Result<SkinScores, ScoreError> {
        let mut decoders = PublishedDecode::named(&self.learned)?;
        decoders.extend(more.iter().cloned());
        let (mut compressive, mut raster) = (Vec::new(), Vec::new());
        for session in &self.sessions {
            compressive.extend(score_session(session, &decoders, measurements, done)?);
            raster.extend(score_raster(session, &self.learned, measurements));
            done();
        }
        let located = match &self.bounces {
            Some(recording) => localise(recording, &self.learned.shifted, self.learned.cols, localisation)?,
            None => Vec::new(),
        };
        let means = [mean_rows(&compressive), mean_rows(&raster)].concat();
        Ok(SkinScores {
            rows: [compressive, raster, means].concat(),
            localisation: located,
            baselines: baselines(&self.sessions, &self.learned),
        })
    }

    /// The ball's place at every M of `measurements` by every locator, as recorded and with the taxels relabelled; none
    /// without a ball.
    ///
    /// # Errors
    /// [`ScoreError`] when the sheet is no grid or no rows can be chosen.
    pub fn ball_places(&self, measurements: &[usize]) -> Result<Vec<PlaceRow>, ScoreError> {
        let Some(recording) = &self.bounces else {
            return Ok(Vec::new());
        };
        let shifted = self.learned.shifted.clone();
        places(recording, shifted, self.learned.cols, measurements, &[Sensing::Random])
    }
}

impl SkinScores {
    /// Row of `object` ("mean" for the mean) for variant `decode` and `m`.
    #[must_use]
    pub fn row(&self, object: &str, decode: &str, m: usize) -> Option<&ScoreRow> {
        let found = |r: &&ScoreRow| r.object == object && r.decode == decode && r.m == m;
        self.rows.iter().find(found)
    }

    /// Localisation row for variant `decode` and `m`.
    #[must_use]
    pub fn located(&self, decode: &str, m: usize) -> Option<&LocalisationRow> {
        self.localisation.iter().find(|r| r.decode == decode && r.m == m)
    }
}
