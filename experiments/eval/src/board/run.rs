//! Scores every entry of a plan on every press.

use super::algorithm::{Algorithm, Answer, Class, DecodeError, Trained};
use super::plan::LAYOUT;
use super::rows::{ObjectRow, Row, Scores};
use super::tally::{Tally, intervals, mean, pool};
use super::timing;
use super::window::{Press, Window};
use crate::score::{Protocol, ScoredSession, Truth};
use rayon::prelude::*;
use spts_models::Streams;
use spts_recon::Workspace;
use spts_recon::classify::{Src, vote_groups};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use std::sync::Arc;

/// An algorithm with what it has learned for one scored object.
#[derive(Clone)]
pub(super) struct Pupil {
    pub(super) trained: Arc<dyn Trained>,
    /// Classifies images of algorithms that say no class.
    pub(super) classifier: Arc<Src>,
}

/// One line of the board before it is scored.
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) learned_from: String,
    pub(super) left_out: bool,
    /// One a scored session.
    pub(super) pupils: Vec<Pupil>,
}

/// What is scored.
pub(super) struct Course<'a> {
    /// Sessions with a compressive recording.
    pub(super) sessions: Vec<&'a ScoredSession>,
    pub(super) measurements: Vec<usize>,
    /// Whether decodes are timed.
    pub(super) times: bool,
}

impl Course<'_> {
    /// ScoredSession and block of every scored press.
    pub(super) fn presses(&self) -> Vec<(usize, usize)> {
        let each = |(i, s): (usize, &&ScoredSession)| s.scored().map(|b| (i, b)).collect::<Vec<_>>();
        self.sessions.iter().enumerate().flat_map(each).collect()
    }

    /// Scores `entries`; `done` is called after every press.
    ///
    /// # Errors
    /// [`DecodeError::External`].
    pub(super) fn score(
        &self,
        entries: &[Entry],
        done: &(dyn Fn() + Sync),
    ) -> Result<(Vec<Row>, Vec<ObjectRow>), DecodeError> {
        let presses = self.presses();
        let tallies = presses
            .par_iter()
            .map(|&(session, block)| {
                let tallies = self.press(entries, session, block);
                done();
                tallies
            })
            .collect::<Result<Vec<_>, DecodeError>>()?;
        let times = if self.times { self.times(entries)? } else { Vec::new() };
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
                objects.extend(self.sessions.iter().zip(scores).map(|(session, scores)| ObjectRow {
                    decoder: entry.name.clone(),
                    m,
                    left_out: entry.left_out,
                    learned_from: entry.learned_from.clone(),
                    object: session.object.clone(),
                    scores,
                }));
            }
        }
        Ok((rows, objects))
    }

    fn row(&self, entry: &Entry, m: usize, presses: &[Vec<&Tally>], scores: &[Scores], decode_us: Option<f64>) -> Row {
        let (support_ci, iou_ci, class_single_ci) = intervals(presses, Streams::new(1));
        let rate_hz = self.sessions.first().and_then(|s| s.compressive.as_ref());
        let acquire_us = rate_hz.map_or(0.0, |c| m as f64 / c.sample_rate_hz() * 1e6);
        Row {
            decoder: entry.name.clone(),
            m,
            left_out: entry.left_out,
            learned_from: entry.learned_from.clone(),
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

    fn press(&self, entries: &[Entry], session: usize, block: usize) -> Result<Vec<Tally>, DecodeError> {
        let scored = self.sessions[session];
        let (Some(recording), Some(truth)) = (&scored.compressive, scored.truth(block)) else {
            return Ok(vec![Tally::default(); entries.len() * self.measurements.len()]);
        };
        let press = Press::new(recording, block, &scored.protocol);
        let mut tallies = Vec::with_capacity(entries.len() * self.measurements.len());
        for entry in entries {
            let mut scorer = Scorer {
                press: &press,
                truth: &truth,
                protocol: &scored.protocol,
                per_frame: recording.measurements_per_frame(),
                label: (!entry.left_out && entry.learned_from != LAYOUT).then_some(scored.label),
                algorithm: entry.pupils[session].trained.start(),
                classifier: &entry.pupils[session].classifier,
                work: Workspace::default(),
            };
            for &m in &self.measurements {
                tallies.push(scorer.score(m)?);
            }
        }
        Ok(tallies)
    }

    /// Median time of a decode for every entry and M, µs, on the first scored press.
    fn times(&self, entries: &[Entry]) -> Result<Vec<Option<f64>>, DecodeError> {
        let first = self.presses().first().copied();
        let Some((press, pupil)) = first.and_then(|(session, block)| {
            let recording = self.sessions[session].compressive.as_ref()?;
            Some((Press::new(recording, block, &self.sessions[session].protocol), session))
        }) else {
            return Ok(Vec::new());
        };
        let mut times = Vec::new();
        for entry in entries {
            let mut algorithm = entry.pupils[pupil].trained.start();
            for &m in &self.measurements {
                times.push(timing::median_us(algorithm.as_mut(), &press, m)?);
            }
        }
        Ok(times)
    }
}

/// One algorithm on one press.
struct Scorer<'a> {
    press: &'a Press,
    truth: &'a Truth,
    protocol: &'a Protocol,
    per_frame: usize,
    /// Right class; `None` when classes are not scored.
    label: Option<usize>,
    algorithm: Box<dyn Algorithm + 'a>,
    classifier: &'a Src,
    work: Workspace,
}

impl Scorer<'_> {
    fn score(&mut self, m: usize) -> Result<Tally, DecodeError> {
        let mut tally = Tally::default();
        let stride = self.protocol.support_stride * self.per_frame;
        let starts = (0..self.press.len()).step_by(stride);
        let windows: Vec<Window<'_>> = starts.filter_map(|s| self.press.window(s, m)).collect();
        let mut mask = Vec::new();
        for answer in self.algorithm.decode_all(&windows)? {
            support(&answer.image, SUPPORT_THRESHOLD, &mut mask);
            // an algorithm that makes no image scores as one that sees nothing
            mask.resize(self.truth.support.len(), false);
            tally.supports.push(SupportScore::new(&mask, &self.truth.support));
            // windows of the classes are counted below, and overlap with these
            tally.failed += usize::from(answer.failed && self.label.is_none());
        }
        if let Some(label) = self.label {
            self.classes(m, label, &mut tally)?;
        }
        Ok(tally)
    }

    fn classes(&mut self, m: usize, label: usize, tally: &mut Tally) -> Result<(), DecodeError> {
        let count = self.protocol.windows(m, self.per_frame);
        let windows: Vec<Window<'_>> = (0..count).filter_map(|w| self.press.window(w * m, m)).collect();
        let answers = self.algorithm.decode_all(&windows)?;
        let decisions: Vec<Option<usize>> = answers.iter().map(|a| self.class(a)).collect();
        tally.failed += answers.iter().filter(|a| a.failed).count();
        tally.single.add(&decisions, label);
        tally
            .voted
            .add(&vote_groups(&decisions, self.protocol.vote, false), label);
        let groups = windows.chunks_exact(self.protocol.vote.max(1));
        let summed: Option<Vec<Option<usize>>> = groups
            .map(|group| self.algorithm.sum(group).map(Class::label))
            .collect();
        tally.summed.add(&summed.unwrap_or_default(), label);
        Ok(())
    }

    fn class(&mut self, answer: &Answer) -> Option<usize> {
        match answer.class {
            Some(class) => class.label(),
            None => self.classifier.classify(&answer.image, &mut self.work).ok().flatten(),
        }
    }
}
