//! The whole board of one arm: every object, every decode, every M.

use super::bounce::{LocalisationRow, find_bounces, localise};
use super::raster::score_raster;
use super::scored::ScoredSession;
use super::session::{BaselineRow, Learned, ScoreRow, baselines, mean_rows, score_compressive};
use serde::Serialize;
use spts_circuit::Recording;

/// Everything one arm, the real skin or the twin, is scored on.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Objects.
    pub sessions: Vec<ScoredSession>,
    /// ScoredSession of the bouncing ball.
    pub bounces: Option<Recording>,
    /// What its decoder has learned.
    pub learned: Learned,
    /// Columns of the array.
    pub cols: usize,
}

/// Scores of one arm.
#[derive(Debug, Clone, Serialize)]
pub struct Board {
    /// Per object and, as object "mean", over all objects.
    pub rows: Vec<ScoreRow>,
    /// Localisation of the bouncing ball.
    pub localisation: Vec<LocalisationRow>,
    /// Trivial baselines.
    pub baselines: Vec<BaselineRow>,
}

impl Arm {
    /// Number of times [`Arm::score`] reports progress.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.sessions.iter().map(|s| s.scored().len() + 1).sum()
    }

    /// Scores the arm at every M of `measurements`, and the ball's place at every M of `localisation`; `done` is called after every press and every raster session.
    #[must_use]
    pub fn score(&self, measurements: &[usize], localisation: &[usize], done: &(dyn Fn() + Sync)) -> Board {
        let (mut compressive, mut raster) = (Vec::new(), Vec::new());
        for session in &self.sessions {
            compressive.extend(score_compressive(session, &self.learned, measurements, done));
            raster.extend(score_raster(session, &self.learned, measurements, self.cols));
            done();
        }
        let located = self.bounces.as_ref().map_or_else(Vec::new, |recording| {
            localise(
                recording,
                &find_bounces(recording),
                &self.learned.shifted,
                localisation,
                self.cols,
            )
        });
        let means = [mean_rows(&compressive), mean_rows(&raster)].concat();
        Board {
            rows: [compressive, raster, means].concat(),
            localisation: located,
            baselines: baselines(&self.sessions, &self.learned),
        }
    }
}

impl Board {
    /// Row of `object` ("mean" for the mean) for `decode` and `m`.
    #[must_use]
    pub fn row(&self, object: &str, decode: &str, m: usize) -> Option<&ScoreRow> {
        let found = |r: &&ScoreRow| r.object == object && r.decode == decode && r.m == m;
        self.rows.iter().find(found)
    }

    /// Localisation row for `decode` and `m`.
    #[must_use]
    pub fn located(&self, decode: &str, m: usize) -> Option<&LocalisationRow> {
        self.localisation.iter().find(|r| r.decode == decode && r.m == m)
    }
}
