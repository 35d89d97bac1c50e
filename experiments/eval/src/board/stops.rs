//! Stops the board's decoders as soon as they are confident enough.

use super::run::Entry;
use super::settings::TrainedBoard;
use crate::algorithm::Subject;
use crate::anytime::{
    AnytimeBoard, AnytimeObject, AnytimeRow, End, PressStops, StopScores, StopSettings, Stopper, intervals, mean, pool,
};
use crate::error::ScoreError;
use crate::scorer::ScoredPress;
use rayon::prelude::*;
use spts_recon::StopRule;

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
    /// [`ScoreError::NoConfidence`] for a decoder that states no confidence, [`ScoreError::Refused`] for a
    /// confidence outside (0.5, 1), [`ScoreError::Rows`] if no rows can be chosen.
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
                return Err(ScoreError::no_confidence(&entry.name));
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
