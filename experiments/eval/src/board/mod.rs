//! The board: compares algorithms on the same windows, with ground truth, majority votes and decoding time.
//!
//! [`BoardSettings::learn`] trains, [`TrainedBoard::score`] decodes and scores, and [`regressions`] compares a board
//! with an earlier one.

mod against;
mod learning;
mod table;

pub use crate::decoders::{DECODERS, find};
pub use crate::windows::{Press, Window};
pub use against::{Difference, Regression, differences, regressions};
pub use table::{table, write};

use crate::algorithm::{Contender, DecodeError, ScoreError};
use crate::alignment::SessionSlip;
use crate::decoders::DecoderSpec;
use crate::place::{PlaceRow, places, touch_places};
use crate::scorer::{ScoredPress, Scorer, decode_us};
use crate::sensing::{RowChooser, Sensing};
use crate::session::ScoredSession;
use crate::source::Source;
use crate::tally::{Scores, Tally, intervals, mean, pool};
use crate::training::{LearnError, TrainedNetwork, TrainingSource};
pub(crate) use learning::Entry;
use learning::{Trainer, TrainingRequest};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_models::Streams;
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
    pub(crate) source: &'a Source,
    pub(crate) run: Run<'a>,
    pub(crate) entries: Vec<Entry>,
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
    pub(crate) fn ball(&self) -> Option<&Recording> {
        let asked = !self.settings.localisation.is_empty();
        self.source.bounces.as_ref().filter(|_| asked)
    }

    /// Columns of the sheet.
    pub(crate) fn cols(&self) -> usize {
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
            let valid: Vec<&str> = valid.map(ScoredSession::title).collect();
            return Err(ScoreError::Sessions(Refusal::new(format!(
                "object {name:?} has no compressive session; valid: {}",
                valid.join(", ")
            ))));
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
            return Err(no_session(source));
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

/// The error of a `source` without anything to score: its sessions, each with what it has.
pub(crate) fn no_session(source: &Source) -> ScoreError {
    let each = source.sessions.iter().map(|session| {
        let modes = match (session.raster.is_some(), session.compressive.is_some()) {
            (true, true) => "both",
            (true, false) => "raster alone",
            (false, true) => "compressive alone",
            (false, false) => "neither",
        };
        format!("{:?} ({modes})", session.title())
    });
    let found = match each.collect::<Vec<String>>() {
        none if none.is_empty() => "no session of presses".to_owned(),
        each => each.join(", "),
    };
    ScoreError::Sessions(Refusal::new(format!(
        "scoring needs an object with both a raster and a compressive recording; found: {found}"
    )))
}

/// Windows that are timed.
const TIMED_WINDOWS: usize = 200;

/// What is scored.
pub(crate) struct Run<'a> {
    /// Sessions with a compressive recording.
    pub(crate) sessions: Vec<&'a ScoredSession>,
    pub(crate) measurements: Vec<usize>,
    /// Whether decodes are timed.
    pub(crate) times: bool,
}

impl Run<'_> {
    /// Session and block of every scored press.
    pub(crate) fn presses(&self) -> Vec<(usize, usize)> {
        let each = |(i, s): (usize, &&ScoredSession)| s.scored().map(|b| (i, b)).collect::<Vec<_>>();
        self.sessions.iter().enumerate().flat_map(each).collect()
    }

    /// Scores `entries`; `done` is called after every press.
    ///
    /// # Errors
    /// [`ScoreError`] of an external program, or when no rows can be chosen.
    fn score(
        &self,
        entries: &[Entry],
        done: &(dyn Fn() + Sync),
    ) -> Result<(Vec<BoardRow>, Vec<ObjectRow>), ScoreError> {
        let presses = self.presses();
        let tallies = presses
            .par_iter()
            .map(|&(session, block)| {
                let tallies = self.press(entries, session, block);
                done();
                tallies
            })
            .collect::<Result<Vec<_>, ScoreError>>()?;
        let times = if self.times { self.times(entries)? } else { Vec::new() };
        for decoder in entries.iter().flat_map(|entry| &entry.decoders) {
            decoder.trained.finish()?;
        }
        let (mut rows, mut objects) = (Vec::new(), Vec::new());
        for (e, entry) in entries.iter().enumerate() {
            for (i, &m) in self.measurements.iter().enumerate() {
                let at = e * self.measurements.len() + i;
                let by_object: Vec<Vec<&Tally>> = (0..self.sessions.len())
                    .map(|s| {
                        let of_session = presses.iter().zip(&tallies).filter(|(p, _)| p.0 == s);
                        of_session.map(|(_, t)| &t[at]).collect()
                    })
                    .collect();
                let scores: Vec<Scores> = by_object.iter().map(|p| pool(p.iter().copied())).collect();
                rows.push(self.row(entry, m, &by_object, &scores, times.get(at).copied().flatten()));
                for (session, (presses, scores)) in self.sessions.iter().zip(by_object.into_iter().zip(scores)) {
                    let [_, iou_ci, class_single_ci] = intervals(&[presses], Streams::new(1));
                    objects.push(ObjectRow {
                        decoder: entry.name.clone(),
                        m,
                        left_out: entry.left_out,
                        learned_from: entry.learned_from.clone(),
                        sensing: entry.sensing,
                        object: session.title().to_owned(),
                        scores,
                        iou_ci,
                        class_single_ci,
                    });
                }
            }
        }
        Ok((rows, objects))
    }

    fn row(
        &self,
        entry: &Entry,
        m: usize,
        presses: &[Vec<&Tally>],
        scores: &[Scores],
        decode_us: Option<f64>,
    ) -> BoardRow {
        let [support_ci, iou_ci, class_single_ci] = intervals(presses, Streams::new(1));
        let rate_hz = self.sessions.first().and_then(|s| s.compressive.as_ref());
        let acquire_us = rate_hz.map_or(0.0, |c| m as f64 / c.sample_rate_hz() * 1e6);
        BoardRow {
            decoder: entry.name.clone(),
            m,
            left_out: entry.left_out,
            learned_from: entry.learned_from.clone(),
            sensing: entry.sensing,
            scores: mean(scores),
            support_ci,
            iou_ci,
            class_single_ci,
            decode_us,
            acquire_us,
            too_slow: decode_us.map(|us| us >= acquire_us),
            failed: presses.iter().flatten().map(|t| t.failed).sum(),
        }
    }

    fn press(&self, entries: &[Entry], session: usize, block: usize) -> Result<Vec<Tally>, ScoreError> {
        let scored = self.sessions[session];
        let Some(press) = ScoredPress::new(scored, block) else {
            return Ok(vec![Tally::default(); entries.len() * self.measurements.len()]);
        };
        let classes = |entry: &Entry| entry.knows_classes;
        let tallies = self.each_entry(entries, session, &press, classes, |entry, press| {
            let mut scorer = Scorer::new(&entry.decoders[session]);
            let label = entry.knows_classes.then_some(scored.label);
            let each = self.measurements.iter();
            let tallies = each.map(|&m| Ok(scorer.score(press, m, label)?));
            tallies.collect::<Result<Vec<Tally>, ScoreError>>()
        })?;
        Ok(tallies.concat())
    }

    /// What `score` makes of `press` for every entry: the press as it is, or at rows that are chosen for the entry, as
    /// many as the largest number of measurements; for classes where `classes` says so. Rows are chosen once for all
    /// that has learned from the same.
    pub(crate) fn each_entry<'e, T>(
        &self,
        entries: impl IntoIterator<Item = &'e Entry>,
        session: usize,
        press: &ScoredPress<'_>,
        classes: impl Fn(&Entry) -> bool,
        mut score: impl FnMut(&Entry, &ScoredPress<'_>) -> Result<T, ScoreError>,
    ) -> Result<Vec<T>, ScoreError> {
        let mut chosen: Vec<(&Arc<RowChooser>, bool, ScoredPress<'_>)> = Vec::new();
        let mut scores = Vec::new();
        for entry in entries {
            let Some(chooser) = entry.choosers.get(session) else {
                scores.push(score(entry, press)?);
                continue;
            };
            let classes = classes(entry);
            let mut each = chosen.iter();
            let at = match each.position(|(other, with, _)| Arc::ptr_eq(other, chooser) && *with == classes) {
                Some(at) => at,
                None => {
                    chosen.push((
                        chooser,
                        classes,
                        press.chosen(chooser, self.most(), classes).map_err(ScoreError::rows)?,
                    ));
                    chosen.len() - 1
                }
            };
            scores.push(score(entry, &chosen[at].2)?);
        }
        Ok(scores)
    }

    /// The largest number of measurements.
    pub(crate) fn most(&self) -> usize {
        self.measurements.iter().copied().max().unwrap_or(1)
    }

    /// Median time of a decode for every entry and M, µs, on the first scored press.
    fn times(&self, entries: &[Entry]) -> Result<Vec<Option<f64>>, DecodeError> {
        let first = self.presses().first().copied();
        let Some((press, session)) = first.and_then(|(session, block)| {
            let recording = self.sessions[session].compressive.as_ref()?;
            Some((Press::new(recording, block, &self.sessions[session].protocol), session))
        }) else {
            return Ok(Vec::new());
        };
        let mut times = Vec::new();
        for entry in entries {
            for &m in &self.measurements {
                times.push(decode_us(&entry.decoders[session], &press, m, TIMED_WINDOWS)?);
            }
        }
        Ok(times)
    }
}

/// A row of the score table: one decoder at one M, means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data: "published", "raster" (raster presses of the same recordings that are not scored), "nothing", or
    /// the name of another source.
    pub learned_from: String,
    /// How the rows of a window are obtained.
    #[serde(default)]
    pub sensing: Sensing,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: Scores,
    /// 95 % confidence interval of `support`, by resampling presses within every object.
    pub support_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `iou`, by the same resampling.
    pub iou_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `class_single`, by the same resampling.
    pub class_single_ci: Option<[f64; 2]>,
    /// Median time of a decode on one thread, µs, from rows of weights and samples to image or class, including Φ·D.
    /// Only this column and `too_slow` differ between runs. `None` if times were not requested.
    pub decode_us: Option<f64>,
    /// Time in which the M measurements arrive, µs.
    pub acquire_us: f64,
    /// Whether a decode takes longer than `acquire_us`; `None` if times were not requested.
    pub too_slow: Option<bool>,
    /// Number of windows that the algorithm could not solve. They score as empty images without a class.
    pub failed: usize,
}

/// A row of the score table of single objects: one decoder at one M on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectRow {
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// As in [`BoardRow`].
    pub left_out: bool,
    /// As in [`BoardRow`].
    pub learned_from: String,
    /// As in [`BoardRow`].
    #[serde(default)]
    pub sensing: Sensing,
    /// Object.
    pub object: String,
    /// Scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// 95 % confidence interval of `iou`, by resampling the object's presses.
    #[serde(default)]
    pub iou_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `class_single`, by the same resampling.
    #[serde(default)]
    pub class_single_ci: Option<[f64; 2]>,
}

/// The score table, what `spts score` prints and saves: decoders side by side on the same windows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ScoreBoard {
    /// Means over the objects.
    pub rows: Vec<BoardRow>,
    /// Localisation of the bouncing ball, and of touches.
    pub localisation: Vec<PlaceRow>,
    /// Object by object.
    pub objects: Vec<ObjectRow>,
    /// Slips of the recordings, which were realigned before scoring.
    #[serde(default)]
    pub slips: Vec<SessionSlip>,
}

impl ScoreBoard {
    /// The row of `decoder`, `m`, `left_out` and `learned_from` with consecutive measurements.
    #[must_use]
    pub fn row(&self, decoder: &str, m: usize, left_out: bool, learned_from: &str) -> Option<&BoardRow> {
        let same = |r: &&BoardRow| {
            let conditions = r.left_out == left_out && r.learned_from == learned_from;
            r.decoder == decoder && r.m == m && conditions && r.sensing == Sensing::Random
        };
        self.rows.iter().find(same)
    }

    /// The row with the same decoder and conditions as `other`.
    #[must_use]
    pub fn row_like(&self, other: &BoardRow) -> Option<&BoardRow> {
        let key = |r: &BoardRow| (r.m, r.left_out, r.sensing);
        let same =
            |r: &&BoardRow| key(r) == key(other) && r.decoder == other.decoder && r.learned_from == other.learned_from;
        self.rows.iter().find(same)
    }
}
