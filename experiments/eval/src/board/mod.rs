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

use crate::algorithm::{Contender, DecodeError};
use crate::alignment::{Alignment, SessionSlip, UnalignedContact};
use crate::decoders::{DecoderSpec, Needs};
use crate::place::{BALL, PlaceRow, places, touch_places};
use crate::scorer::{ScoredPress, Scorer, decode_us};
use crate::sensing::{RowChooser, Sensing};
use crate::session::ScoredSession;
use crate::source::Source;
use crate::tally::{Scores, Tally, intervals, mean, pool};
use crate::training::{TrainedNetwork, TrainingData, TrainingSource};
use crate::truth::TruthKind;
pub(crate) use learning::Entry;
use learning::Trainer;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_circuit::Recording;
use spts_input::Refusal;
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
    pub fn steps(&self) -> usize {
        self.run.presses().len()
    }

    /// Decodes and scores every press. `done` is called after each.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn score(&self, done: &(dyn Fn() + Sync)) -> Result<ScoreBoard, Refusal> {
        let (rows, objects) = self.run.score(&self.entries, done)?;
        let Alignment { slips, unaligned } = self.source.alignment.clone();
        let version = ScoreBoard::VERSION;
        Ok(ScoreBoard { version, rows, objects, slips, unaligned, localisation: Vec::new() })
    }

    /// Results for the bouncing ball and for touches. Without a ball, there are none of locators with a dictionary;
    /// without any recording of either, there are none at all.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn localise(&self) -> Result<Vec<PlaceRow>, Refusal> {
        let shifted = self.dictionary.as_ref().map(|atoms| self.source.shifted(atoms));
        let measurements = &self.settings.localisation;
        let mut rows = Vec::new();
        for (name, touches) in self.source.touches.iter().filter(|_| !measurements.is_empty()) {
            rows.extend(touch_places(name, touches, shifted.as_ref(), measurements)?);
        }
        if let Some(shifted) = shifted {
            let (cols, drops) = (self.source.layout.cols(), &self.source.drops);
            let each = drops.iter().map(|(name, recording)| {
                let name = if drops.len() > 1 { name } else { BALL };
                places(name, recording, shifted.clone(), cols, measurements, &self.settings.sensing)
            });
            rows.splice(..0, each.collect::<Result<Vec<_>, Refusal>>()?.concat());
        }
        Ok(rows)
    }

    /// Whether places are scored.
    pub(crate) fn scores_places(&self) -> bool {
        !self.settings.localisation.is_empty()
    }
}

impl BoardSettings {
    /// Default numbers of measurements.
    pub const MEASUREMENTS: [usize; 8] = [5, 7, 10, 13, 20, 25, 50, 100];
    /// Default numbers of measurements for the ball.
    pub const LOCALISATION: [usize; 6] = [5, 7, 10, 15, 20, 25];

    /// The algorithms on the board if none is named.
    pub fn shown() -> Vec<&'static DecoderSpec> {
        DECODERS.iter().filter(|spec| spec.shown).collect()
    }

    /// Trains everything that [`TrainedBoard::score`] needs.
    ///
    /// # Errors
    /// [`Refusal`] if there is nothing to score, or no training data.
    pub fn learn<'a>(&'a self, source: &'a Source) -> Result<TrainedBoard<'a>, Refusal> {
        let asked = |s: &&ScoredSession| {
            self.objects.is_empty() || self.objects.contains(&s.object) || self.objects.contains(&s.name)
        };
        let scorable = || source.scorable();
        let sessions: Vec<&ScoredSession> = scorable().filter(asked).collect();
        let known = |name: &&String| sessions.iter().any(|s| s.object == **name || s.name == **name);
        if let Some(name) = self.objects.iter().find(|name| !known(name)) {
            let valid: Vec<&str> = scorable().map(ScoredSession::title).collect();
            let problem = format!("object {name:?} has no compressive session; valid: {}", valid.join(", "));
            return Err(Refusal::new(problem).at(source.root.display()));
        }
        let places = !self.localisation.is_empty();
        let touches = places && !source.touches.is_empty();
        if sessions.is_empty() && !touches {
            return Err(no_session(source));
        }
        let (mut entries, mut dictionary) = (Vec::new(), None);
        // touches alone are located; nothing is learned, and no image is scored
        if !sessions.is_empty() {
            let mut trainer = Trainer::new(source, self);
            entries = trainer.entries(&sessions)?;
            // locators learn, which nothing can on a large skin without scans
            let large = source.layout.taxels() > TrainingData::MOST_TAXELS && !source.learns();
            if (touches || places && !source.drops.is_empty()) && !large {
                dictionary = Some(trainer.dictionary()?);
            }
        }
        Ok(TrainedBoard {
            settings: self,
            source,
            run: Run { sessions, measurements: self.measurements.clone(), times: self.times, by_raster: false },
            entries,
            dictionary,
        })
    }
}

/// The error of a `source` without anything to score: its sessions, each with what it has.
pub(crate) fn no_session(source: &Source) -> Refusal {
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
    let problem = format!(
        "scoring needs an object with both a raster and a compressive recording; found: {found}; `spts wire` records frames with both"
    );
    Refusal::new(problem).at(source.root.display())
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
    /// Whether the truth is the raster frame of another press, as published.
    pub(crate) by_raster: bool,
}

impl Run<'_> {
    /// Number of the object of every session.
    pub(crate) fn objects(&self) -> Vec<usize> {
        let first = |s: &&ScoredSession| self.sessions.iter().position(|other| other.object == s.object).unwrap_or(0);
        self.sessions.iter().map(first).collect()
    }

    /// Session and block of every scored press.
    pub(crate) fn presses(&self) -> Vec<(usize, usize)> {
        let each = |(i, s): (usize, &&ScoredSession)| s.scored().map(|b| (i, b)).collect::<Vec<_>>();
        self.sessions.iter().enumerate().flat_map(each).collect()
    }

    /// What `measure` finds in every press, `slots` values each: by slot, then by session. Presses run in parallel, and
    /// `done` is called after each; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// The first error of `measure`.
    pub(crate) fn each_press<T: Send>(
        &self,
        slots: usize,
        done: &(dyn Fn() + Sync),
        measure: impl Fn(usize, usize) -> Result<Vec<T>, Refusal> + Sync,
    ) -> Result<Vec<Vec<Vec<T>>>, Refusal> {
        let presses = self.presses();
        let each = presses.par_iter().map(|&(session, block)| {
            let values = measure(session, block);
            done();
            values
        });
        let each = each.collect::<Result<Vec<Vec<T>>, Refusal>>()?;
        let of_slot = |_| self.sessions.iter().map(|_| Vec::new()).collect();
        let mut slots: Vec<Vec<Vec<T>>> = (0..slots).map(of_slot).collect();
        for ((session, _), values) in presses.iter().zip(each) {
            for (slot, value) in slots.iter_mut().zip(values) {
                slot[*session].push(value);
            }
        }
        Ok(slots)
    }

    /// Every entry at every M, in the order of [`Run::tallies`].
    pub(crate) fn slots<'e>(&self, entries: &'e [Entry]) -> impl Iterator<Item = (&'e Entry, usize)> {
        entries.iter().flat_map(|entry| self.measurements.iter().map(move |&m| (entry, m)))
    }

    /// Scores every press by every entry at every M: the one loop over windows of the board and of the published
    /// evaluation. `done` is called after every press.
    ///
    /// # Errors
    /// [`Refusal`] of an external program, or when no rows can be chosen.
    pub(crate) fn tallies(&self, entries: &[Entry], done: &(dyn Fn() + Sync)) -> Result<Vec<Vec<Vec<Tally>>>, Refusal> {
        let slots = entries.len() * self.measurements.len();
        self.each_press(slots, done, |session, block| {
            let scored = self.sessions[session];
            let press = if self.by_raster { ScoredPress::by_raster } else { ScoredPress::new };
            let Some(press) = press(scored, block, &self.measurements) else {
                return Ok(Vec::new());
            };
            let classes = |entry: &Entry| entry.knows_classes;
            let tallies = self.each_entry(entries, session, &press, classes, |entry, press| {
                let mut scorer = Scorer::new(&entry.decoders[session]);
                let label = entry.knows_classes.then_some(scored.label);
                let each = self.measurements.iter();
                each.map(|&m| Ok(scorer.score(press, m, label)?)).collect::<Result<Vec<Tally>, Refusal>>()
            })?;
            Ok(tallies.concat())
        })
    }

    fn score(&self, entries: &[Entry], done: &(dyn Fn() + Sync)) -> Result<(Vec<BoardRow>, Vec<ObjectRow>), Refusal> {
        let tallies = self.tallies(entries, done)?;
        let times = if self.times { self.times(entries)? } else { Vec::new() };
        for decoder in entries.iter().flat_map(|entry| &entry.decoders) {
            decoder.trained.finish()?;
        }
        let rate_hz = self.sessions.first().and_then(|s| s.compressive.as_ref()).map(Recording::sample_rate_hz);
        let times = times.into_iter().chain(std::iter::repeat(None));
        let (mut rows, mut objects) = (Vec::new(), Vec::new());
        for (((entry, m), presses), decode_us) in self.slots(entries).zip(&tallies).zip(times) {
            let key = RowKey {
                decoder: entry.name.clone(),
                m,
                left_out: entry.left_out,
                learned_from: entry.learned_from.clone(),
                sensing: entry.sensing,
            };
            let scores: Vec<Scores> = presses.iter().map(pool).collect();
            let [support_ci, iou_ci, class_single_ci] = intervals(presses, &self.objects());
            let worst = worst(&self.sessions, &scores);
            let acquire_us = rate_hz.map_or(0.0, |rate_hz| m as f64 / rate_hz * 1e6);
            rows.push(BoardRow {
                key: key.clone(),
                scores: mean(&scores),
                look_up: entry.knows_classes && find(&entry.name).is_some_and(|spec| spec.needs == Needs::Classes),
                worst_object: worst.map(|(object, _)| object.to_owned()),
                worst_iou: worst.map(|(_, iou)| iou),
                support_ci,
                iou_ci,
                class_single_ci,
                decode_us,
                acquire_us,
                too_slow: decode_us.map(|us| us >= acquire_us),
                failed: presses.iter().flatten().map(|t| t.failed).sum(),
            });
            objects.extend(self.sessions.iter().zip(presses).zip(scores).map(|((session, presses), scores)| {
                let [_, iou_ci, class_single_ci] = intervals(std::slice::from_ref(presses), &[0]);
                let (object, truth) = (session.title().to_owned(), presses.first().and_then(|press| press.kind));
                ObjectRow { key: key.clone(), object, truth, scores, iou_ci, class_single_ci }
            }));
        }
        Ok((rows, objects))
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
        mut score: impl FnMut(&Entry, &ScoredPress<'_>) -> Result<T, Refusal>,
    ) -> Result<Vec<T>, Refusal> {
        let mut chosen: Vec<(&Arc<RowChooser>, bool, ScoredPress<'_>)> = Vec::new();
        let mut scores = Vec::new();
        for entry in entries {
            let Some(chooser) = entry.choosers.get(session) else {
                scores.push(score(entry, press)?);
                continue;
            };
            let classes = classes(entry);
            let same = |(other, with, _): &(&Arc<RowChooser>, bool, _)| Arc::ptr_eq(other, chooser) && *with == classes;
            let at = chosen.iter().position(same).unwrap_or(chosen.len());
            if at == chosen.len() {
                let press = press.chosen(chooser, self.most(), classes).map_err(|e| e.at("rows"))?;
                chosen.push((chooser, classes, press));
            }
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
        let Some(&(session, block)) = self.presses().first() else {
            return Ok(Vec::new());
        };
        let scored = ScoredPress::new(self.sessions[session], block, &self.measurements);
        let Some(press) = scored.as_ref().and_then(ScoredPress::first) else {
            return Ok(Vec::new());
        };
        let each = self.slots(entries);
        each.map(|(entry, m)| decode_us(&entry.decoders[session], press, m, TIMED_WINDOWS)).collect()
    }
}

/// The session with the lowest IoU, by its name in tables, and that IoU; `None` for fewer than two objects.
fn worst<'a>(sessions: &[&'a ScoredSession], scores: &[Scores]) -> Option<(&'a str, f64)> {
    let each = sessions.iter().zip(scores).filter_map(|(session, scores)| Some((session.title(), scores.iou?)));
    each.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| sessions.iter().any(|s| s.object != sessions[0].object))
}

/// What a row of the score table is about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowKey {
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
}

/// A row of the score table: one decoder at one M, means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    /// Decoder and conditions.
    #[serde(flatten)]
    pub key: RowKey,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: Scores,
    /// Whether the answers are images of classes that were learned, the scored object among them. Such scores say
    /// nothing of other objects.
    #[serde(default)]
    pub look_up: bool,
    /// The session with the lowest `iou`, by its name in tables, and that `iou`; `None` for a single object.
    #[serde(default)]
    pub worst_object: Option<String>,
    /// See `worst_object`.
    #[serde(default)]
    pub worst_iou: Option<f64>,
    /// 95 % confidence interval of `support` over objects, their sessions and presses; over sessions and presses of a
    /// single object.
    pub support_ci: Option<[f64; 2]>,
    /// The same of `iou`.
    pub iou_ci: Option<[f64; 2]>,
    /// The same of `class_single`.
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
    /// Decoder and conditions.
    #[serde(flatten)]
    pub key: RowKey,
    /// Object.
    pub object: String,
    /// Where the true images come from.
    #[serde(default)]
    pub truth: Option<TruthKind>,
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
    /// [`ScoreBoard::VERSION`] of the program that scored it. Boards of other versions are scored against other truths.
    #[serde(default)]
    pub version: u32,
    /// Means over the objects.
    pub rows: Vec<BoardRow>,
    /// Localisation of the bouncing ball, and of touches.
    pub localisation: Vec<PlaceRow>,
    /// Object by object.
    pub objects: Vec<ObjectRow>,
    /// Slips of the recordings, which were realigned before scoring.
    #[serde(default)]
    pub slips: Vec<SessionSlip>,
    /// Contacts of drops that fit no rows, which are not scored.
    #[serde(default)]
    pub unaligned: Vec<UnalignedContact>,
}

impl ScoreBoard {
    /// Version of the scores: 2 holds images against their own press, 0 against a raster frame of another one.
    pub const VERSION: u32 = 2;

    /// The row with this key.
    pub(crate) fn row_like(&self, key: &RowKey) -> Option<&BoardRow> {
        self.rows.iter().find(|row| row.key == *key)
    }
}
