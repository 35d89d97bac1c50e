//! Scores every entry of a board on every press.

use super::rows::{BoardRow, ObjectRow};
use crate::algorithm::DecodeError;
use crate::decoders::TrainedDecoder;
use crate::error::ScoreError;
use crate::scorer::{ScoredPress, Scorer};
use crate::sensing::{RowChooser, Sensing};
use crate::session::ScoredSession;
use crate::tally::{Scores, Tally, intervals, mean, pool};
use crate::timing::decode_us;
use crate::windows::Press;
use rayon::prelude::*;
use spts_models::Streams;
use std::sync::Arc;

/// Windows that are timed.
const TIMED_WINDOWS: usize = 200;

/// One line of the board before it is scored.
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) learned_from: String,
    pub(super) left_out: bool,
    pub(super) sensing: Sensing,
    /// Whether the scored classes are in the training data, so that classes are scored.
    pub(super) knows_classes: bool,
    /// One decoder for each scored session.
    pub(super) decoders: Vec<TrainedDecoder>,
    /// One row chooser for each scored session; empty for consecutive measurements.
    pub(super) choosers: Vec<Arc<RowChooser>>,
}

/// What is scored.
pub(super) struct Run<'a> {
    /// Sessions with a compressive recording.
    pub(super) sessions: Vec<&'a ScoredSession>,
    pub(super) measurements: Vec<usize>,
    /// Whether decodes are timed.
    pub(super) times: bool,
}

impl Run<'_> {
    /// Session and block of every scored press.
    pub(super) fn presses(&self) -> Vec<(usize, usize)> {
        let each = |(i, s): (usize, &&ScoredSession)| s.scored().map(|b| (i, b)).collect::<Vec<_>>();
        self.sessions.iter().enumerate().flat_map(each).collect()
    }

    /// Scores `entries`; `done` is called after every press.
    ///
    /// # Errors
    /// [`ScoreError::Decode`] of an external program, [`ScoreError::Rows`] when no rows can be chosen.
    pub(super) fn score(
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
    pub(super) fn each_entry<'e, T>(
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
                        press.chosen(chooser, self.most(), classes).map_err(ScoreError::Rows)?,
                    ));
                    chosen.len() - 1
                }
            };
            scores.push(score(entry, &chosen[at].2)?);
        }
        Ok(scores)
    }

    /// The largest number of measurements.
    pub(super) fn most(&self) -> usize {
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
