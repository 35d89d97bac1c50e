//! Settings of a board: the algorithms, their training data, and what they are scored on.

use super::rows::ScoreBoard;
use super::run::{Entry, Run};
use super::trainer::{Trainer, TrainingRequest};
use crate::algorithm::Contender;
use crate::decoders::{DECODERS, DecoderSpec};
use crate::error::ScoreError;
use crate::place::{PlaceRow, places, touch_places};
use crate::sensing::Sensing;
use crate::session::ScoredSession;
use crate::source::Source;
use crate::training::{LearnError, TrainedNetwork, TrainingSource};
use spts_circuit::Recording;
use spts_recon::Matrix;
use std::sync::Arc;

/// What `spts score` has to score: decoders, objects, numbers of measurements, and what the decoders learn from.
pub struct BoardSettings {
    /// Algorithms.
    pub decoders: Vec<&'static DecoderSpec>,
    /// External algorithms: programs, and other implementations of the trait.
    pub external: Vec<Arc<dyn Contender>>,
    /// Numbers of measurements.
    pub measurements: Vec<usize>,
    /// Names of the objects that are scored; empty for all.
    pub objects: Vec<String>,
    /// Numbers of measurements for the bouncing ball and for touches.
    pub localisation: Vec<usize>,
    /// Whether every algorithm is also scored with the scored object excluded from its training data.
    pub left_out: bool,
    /// Sources of training data. Every algorithm is scored with each.
    pub training: Vec<TrainingSource>,
    /// Ways to obtain the rows of windows. Every algorithm is scored with each.
    pub sensing: Vec<Sensing>,
    /// The network for decoders that use one; `None` for the one shipped with the program.
    pub network: Option<TrainedNetwork>,
    /// Whether decodes are timed.
    pub times: bool,
    /// Seed of the random numbers for dictionary learning.
    pub seed: u64,
}

/// Trained algorithms, and the presses on which they will be scored.
pub struct TrainedBoard<'a> {
    settings: &'a BoardSettings,
    pub(super) source: &'a Source,
    pub(super) run: Run<'a>,
    pub(super) entries: Vec<Entry>,
    /// Dictionary for the ball and for touches.
    dictionary: Option<Matrix>,
}

impl TrainedBoard<'_> {
    /// Number of presses; [`TrainedBoard::score`] reports after each.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.run.presses().len()
    }

    /// Decodes and scores every press. `done` is called after each.
    ///
    /// # Errors
    /// [`ScoreError`].
    pub fn score(&self, done: &(dyn Fn() + Sync)) -> Result<ScoreBoard, ScoreError> {
        let (rows, objects) = self.run.score(&self.entries, done)?;
        Ok(ScoreBoard {
            rows,
            localisation: Vec::new(),
            objects,
            slips: self.source.slips.clone(),
        })
    }

    /// Results for the bouncing ball and for touches. Without a ball, there are none of locators with a dictionary;
    /// without any recording of either, there are none at all.
    ///
    /// # Errors
    /// [`ScoreError`].
    pub fn localise(&self) -> Result<Vec<PlaceRow>, ScoreError> {
        let shifted = self
            .dictionary
            .as_ref()
            .map(|dictionary| self.source.shifted(dictionary));
        let measurements = &self.settings.localisation;
        let mut rows = Vec::new();
        for (name, touches) in self.source.touches.iter().filter(|_| !measurements.is_empty()) {
            rows.extend(touch_places(name, touches, shifted.as_ref(), measurements)?);
        }
        if let (Some(bounces), Some(shifted)) = (&self.source.bounces, shifted) {
            let cols = self.source.layout.cols();
            let ball = places(bounces, shifted, cols, measurements, &self.settings.sensing)?;
            rows.splice(..0, ball);
        }
        Ok(rows)
    }
}

impl TrainedBoard<'_> {
    /// Recording of the bouncing ball, where it is to be scored.
    pub(super) fn ball(&self) -> Option<&Recording> {
        let asked = !self.settings.localisation.is_empty();
        self.source.bounces.as_ref().filter(|_| asked)
    }

    /// Columns of the sheet.
    pub(super) fn cols(&self) -> usize {
        self.source.layout.cols()
    }
}

/// The published dictionary, or the one that is learned without it.
fn dictionary(source: &Source, trainer: &mut Trainer<'_>) -> Result<Matrix, LearnError> {
    match &source.published {
        Some(published) => Ok(published.dictionary.clone()),
        None => Ok(trainer
            .sets
            .data(&TrainingSource::Raster, false, None)?
            .dictionary()?
            .atoms
            .clone()),
    }
}

impl BoardSettings {
    /// Default numbers of measurements.
    pub const MEASUREMENTS: [usize; 8] = [5, 7, 10, 13, 20, 25, 50, 100];
    /// Default numbers of measurements for the ball.
    pub const LOCALISATION: [usize; 6] = [5, 7, 10, 15, 20, 25];

    /// The algorithms on the board if none is named.
    #[must_use]
    pub fn shown() -> Vec<&'static DecoderSpec> {
        DECODERS.iter().filter(|spec| spec.shown).collect()
    }

    /// Trains everything that [`TrainedBoard::score`] needs.
    ///
    /// # Errors
    /// [`ScoreError`] if there is nothing to score, or no training data.
    pub fn learn<'a>(&'a self, source: &'a Source) -> Result<TrainedBoard<'a>, ScoreError> {
        let run = self.run(source);
        let scored: Vec<&str> = run.sessions.iter().map(|s| s.object.as_str()).collect();
        let known = |name: &String| run.sessions.iter().any(|s| s.object == *name || s.name == *name);
        if let Some(name) = self.objects.iter().find(|name| !known(name)) {
            let valid = source.sessions.iter().filter(|s| s.scorable());
            return Err(ScoreError::Object {
                name: name.clone(),
                valid: valid.map(ScoredSession::title).collect::<Vec<_>>().join(", "),
            });
        }
        let touches = !self.localisation.is_empty() && !source.touches.is_empty();
        if run.sessions.is_empty() && touches && self.objects.is_empty() {
            // touches alone are located; nothing is learned, and no image is scored
            return Ok(TrainedBoard {
                settings: self,
                source,
                run,
                entries: Vec::new(),
                dictionary: None,
            });
        }
        if run.sessions.is_empty() {
            return Err(ScoreError::NoSession { found: found(source) });
        }
        let mut trainer = Trainer::new(source, self.seed);
        let asked = TrainingRequest {
            decoders: &self.decoders,
            external: &self.external,
            training: &self.training,
            left_out: self.left_out,
            sensing: &self.sensing,
            network: self.network.as_ref(),
            objects: &scored,
        };
        let entries = trainer.entries(&asked)?;
        let ball = touches || (!self.localisation.is_empty() && source.bounces.is_some());
        let dictionary = ball.then(|| dictionary(source, &mut trainer)).transpose()?;
        Ok(TrainedBoard {
            settings: self,
            source,
            run,
            entries,
            dictionary,
        })
    }

    fn run<'a>(&self, source: &'a Source) -> Run<'a> {
        let asked = |s: &&ScoredSession| {
            self.objects.is_empty() || self.objects.contains(&s.object) || self.objects.contains(&s.name)
        };
        let sessions = source.sessions.iter().filter(|s| s.scorable()).filter(asked);
        Run {
            sessions: sessions.collect(),
            measurements: self.measurements.clone(),
            times: self.times,
        }
    }
}

/// The sessions of `source`, each with what it has, for an error.
pub(super) fn found(source: &Source) -> String {
    let each = source.sessions.iter().map(|session| {
        let modes = match (session.raster.is_some(), session.compressive.is_some()) {
            (true, true) => "both",
            (true, false) => "raster alone",
            (false, true) => "compressive alone",
            (false, false) => "neither",
        };
        format!("{:?} ({modes})", session.title())
    });
    let each: Vec<String> = each.collect();
    if each.is_empty() {
        "no session of presses".to_owned()
    } else {
        each.join(", ")
    }
}
