//! Decoders that stop as soon as they are confident enough: how many samples they need, and how often they are right.
//!
//! A decoder that states its confidence after every sample ([`crate::algorithm::Confidence`]) gets the samples of a
//! window one by one. For every wanted confidence it stops at the first sample that reaches it, and its answer there is
//! scored as on the board. The same decoder with a fixed number of samples is the comparison.
//! [`crate::board::TrainedBoard::stops`] trains and provides the windows.

mod stopper;
mod table;

pub use stopper::StopScores;
pub(crate) use stopper::{End, PressStops, Stopper, intervals, mean, pool};
pub use table::{table, write};

use crate::algorithm::{ScoreError, Subject};
use crate::board::{Entry, TrainedBoard};
use crate::decoders::no_confidence;
use crate::scorer::ScoredPress;
use crate::sensing::Sensing;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_recon::StopRule;

/// Confidences at which decoders stop in `spts score --anytime`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopSettings {
    /// Wanted probabilities of the best class, each in (0.5, 1).
    pub class: Vec<f64>,
    /// Wanted expected intersections over union of the image, each in (0.5, 1).
    pub image: Vec<f64>,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self {
            class: vec![0.8, 0.9, 0.95, 0.99],
            image: vec![0.6, 0.7, 0.8],
        }
    }
}

impl StopSettings {
    /// The confidences wanted of a decoder of `subject`.
    pub(crate) fn of(&self, subject: Subject) -> &[f64] {
        match subject {
            Subject::Class => &self.class,
            Subject::Image => &self.image,
        }
    }
}

/// One decoder with one stopping rule: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeRow {
    /// Algorithm.
    pub decoder: String,
    /// The property to which the confidence refers, and of which `attained` is the score.
    pub subject: Subject,
    /// How the rows of a window are obtained.
    pub sensing: Sensing,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data, named as on the board.
    pub learned_from: String,
    /// Confidence at which the decoder stops; `None` for a fixed number of samples.
    pub confidence: Option<f64>,
    /// Largest number of samples in a window.
    pub most: usize,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: StopScores,
    /// 95 % confidence interval of `samples`, by resampling presses within every object.
    pub samples_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `attained`, by the same resampling.
    pub attained_ci: Option<[f64; 2]>,
    /// Number of windows of all objects.
    pub windows: usize,
    /// Number of windows that the algorithm could not process to the end. They count as never confident and wrong.
    pub failed: usize,
}

/// Results of `spts score --anytime` for one object, decoder and confidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeObject {
    /// Algorithm.
    pub decoder: String,
    /// As in [`AnytimeRow`].
    pub subject: Subject,
    /// As in [`AnytimeRow`].
    pub sensing: Sensing,
    /// As in [`AnytimeRow`].
    pub left_out: bool,
    /// As in [`AnytimeRow`].
    pub learned_from: String,
    /// As in [`AnytimeRow`].
    pub confidence: Option<f64>,
    /// Object.
    pub object: String,
    /// Scores.
    #[serde(flatten)]
    pub scores: StopScores,
    /// Number of windows of the object.
    pub windows: usize,
}

/// Results of `spts score --anytime`: how many samples decoders need to be sure, and how often they are right then.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnytimeBoard {
    /// Means over the objects.
    pub rows: Vec<AnytimeRow>,
    /// Object by object.
    pub objects: Vec<AnytimeObject>,
}

/// An entry with all ways to end its windows.
struct Stopped<'a> {
    entry: &'a Entry,
    subject: Subject,
    ends: Vec<End>,
}

impl TrainedBoard<'_> {
    /// Stops every decoder at the confidences of `settings`, and after each of the board's numbers of measurements; the
    /// largest of these is the length of a window. Classes are scored if they were trained. `done` is called after
    /// every press.
    ///
    /// # Errors
    /// [`ScoreError`] for a decoder that states no confidence, for a confidence outside (0.5, 1), or if no rows can be
    /// chosen.
    pub fn stops(&self, settings: &StopSettings, done: &(dyn Fn() + Sync)) -> Result<AnytimeBoard, ScoreError> {
        let stopped = self.stopped(settings)?;
        let presses = self.run.presses();
        let each = presses.par_iter().map(|&(session, block)| {
            let stops = self.press(&stopped, session, block);
            done();
            stops
        });
        let stops = each.collect::<Result<Vec<Vec<Vec<PressStops>>>, ScoreError>>()?;
        let mut board = AnytimeBoard::default();
        for (e, stopped) in stopped.iter().enumerate() {
            for (k, &end) in stopped.ends.iter().enumerate() {
                let of_session = |session: usize| -> Vec<&PressStops> {
                    let of_session = presses.iter().zip(&stops).filter(|(press, _)| press.0 == session);
                    of_session.filter_map(|(_, stops)| stops.get(e)?.get(k)).collect()
                };
                let objects: Vec<Vec<&PressStops>> = (0..self.run.sessions.len()).map(of_session).collect();
                self.add(stopped, end, &objects, &mut board);
            }
        }
        Ok(board)
    }

    /// The entries that are stopped: images of all, classes of those that know them.
    fn stopped(&self, settings: &StopSettings) -> Result<Vec<Stopped<'_>>, ScoreError> {
        let mut out = Vec::new();
        for entry in &self.entries {
            let confidence = entry.decoders.first().and_then(|decoder| decoder.trained.confidence());
            let Some((subject, _)) = confidence else {
                return Err(no_confidence(&entry.name).into());
            };
            if subject == Subject::Class && !entry.knows_classes {
                continue;
            }
            let wanted = settings.of(subject).iter();
            let rules = wanted.map(|&confidence| Ok(End::Sure(StopRule::new(confidence, self.run.most())?)));
            let mut ends = rules.collect::<Result<Vec<End>, ScoreError>>()?;
            ends.extend(self.run.measurements.iter().map(|m| End::Fixed(*m)));
            out.push(Stopped { entry, subject, ends });
        }
        Ok(out)
    }

    /// How the windows of a press end, for every entry and every way to end them.
    fn press(&self, stopped: &[Stopped<'_>], session: usize, block: usize) -> Result<Vec<Vec<PressStops>>, ScoreError> {
        let scored = self.run.sessions[session];
        let Some(press) = ScoredPress::new(scored, block) else {
            return Ok(Vec::new());
        };
        let entries = stopped.iter().map(|stopped| stopped.entry);
        let mut each = stopped.iter();
        let classes = |entry: &Entry| {
            let same = stopped.iter().find(|stopped| std::ptr::eq(stopped.entry, entry));
            same.is_some_and(|stopped| stopped.subject == Subject::Class)
        };
        self.run.each_entry(entries, session, &press, classes, |entry, press| {
            let ends = each.next().map_or(&[][..], |stopped| &stopped.ends);
            let Some(mut stopper) = Stopper::new(&entry.decoders[session]) else {
                return Ok(vec![PressStops::default(); ends.len()]);
            };
            let label = entry.knows_classes.then_some(scored.label);
            Ok(stopper.stops(press, ends, self.run.most(), label)?)
        })
    }

    /// Adds the rows of one entry and one way to end its windows.
    fn add(&self, stopped: &Stopped<'_>, end: End, objects: &[Vec<&PressStops>], board: &mut AnytimeBoard) {
        let entry = stopped.entry;
        let scores: Vec<StopScores> = objects.iter().map(|presses| pool(presses.iter().copied())).collect();
        let all = pool(objects.iter().flatten().copied());
        let windows = |presses: &[&PressStops]| presses.iter().map(|press| press.len()).sum::<usize>();
        let [samples_ci, attained_ci] = intervals(objects);
        board.rows.push(AnytimeRow {
            decoder: entry.name.clone(),
            subject: stopped.subject,
            sensing: entry.sensing,
            left_out: entry.left_out,
            learned_from: entry.learned_from.clone(),
            confidence: end.confidence(),
            most: self.run.most(),
            scores: mean(&scores, &all),
            samples_ci,
            attained_ci,
            windows: objects.iter().map(|presses| windows(presses)).sum(),
            failed: objects.iter().flatten().map(|press| press.failed).sum(),
        });
        let each = self.run.sessions.iter().zip(objects).zip(scores);
        board
            .objects
            .extend(each.map(|((session, presses), scores)| AnytimeObject {
                decoder: entry.name.clone(),
                subject: stopped.subject,
                sensing: entry.sensing,
                left_out: entry.left_out,
                learned_from: entry.learned_from.clone(),
                confidence: end.confidence(),
                object: session.title().to_owned(),
                scores,
                windows: windows(presses),
            }));
    }
}
