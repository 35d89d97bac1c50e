//! The scorer: gives windows of a press to an algorithm, and counts its answers.

use crate::algorithm::{Algorithm, Answer, Class, DecodeError};
use crate::decoders::TrainedDecoder;
use crate::protocol::{Protocol, Truth};
use crate::sensing::RowChooser;
use crate::session::ScoredSession;
use crate::tally::Tally;
use crate::training::TrainingData;
use crate::truth::PressTruth;
use crate::windows::{Press, Untouched, Window};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_recon::Workspace;
use spts_recon::classify::Src;
use spts_recon::metrics::median;
use std::hint::black_box;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// A press, and what is scored of it.
#[derive(Debug)]
pub(crate) struct ScoredPress<'a> {
    measured: Measured,
    truth: Arc<PressTruth>,
    /// Truth of every window for images, without the samples of the longest one; `None` if the others do not determine
    /// one.
    truths: Vec<Option<Truth>>,
    protocol: &'a Protocol,
    measurements_per_frame: usize,
}

/// What windows are cut from.
#[derive(Debug)]
enum Measured {
    /// Consecutive measurements.
    Recorded(Press),
    /// Windows that start with the first measurement, one set for images and one for classes.
    Chosen([Vec<Press>; 2]),
    /// Windows that are spread over the press of a large skin; they start with the first measurement.
    Few(Vec<Press>),
}

/// Of skins of more than so many taxels, few windows are scored: their rows are not formed for the whole press.
const MANY_TAXELS: usize = TrainingData::MOST_TAXELS;
/// Windows times taxels of such a press, and the windows at least and at most.
const FEW: (usize, [usize; 2]) = (200_000, [2, 20]);

/// Windows of `most` measurements, spread over `range` of a block.
fn few(recording: &Recording, block: usize, range: Range<usize>, most: usize) -> Vec<Press> {
    let untouched = Untouched::of(recording, block);
    let most = most.min(range.len());
    let count = (FEW.0 / recording.taxels()).clamp(FEW.1[0], FEW.1[1]).min(range.len() / most.max(1)).max(1);
    let start = |k: usize| range.start + (range.len() - most) * k / (count - 1).max(1);
    (0..count).map(|k| untouched.press(recording, block, start(k)..start(k) + most)).collect()
}

impl<'a> ScoredPress<'a> {
    /// Block `block` of the compressive recording of `session`, for windows of these numbers of `measurements`; `None`
    /// without that recording or a true image.
    pub(crate) fn new(session: &'a ScoredSession, block: usize, measurements: &[usize]) -> Option<Self> {
        Self::against(session, block, measurements, session.truth(block)?)
    }

    /// The same against the raster frame of another press, as published; `None` without one.
    pub(crate) fn by_raster(session: &'a ScoredSession, block: usize, measurements: &[usize]) -> Option<Self> {
        Self::against(session, block, measurements, PressTruth::by_raster(session)?)
    }

    fn against(session: &'a ScoredSession, block: usize, measurements: &[usize], truth: PressTruth) -> Option<Self> {
        let recording = session.compressive.as_ref()?;
        let range = session.protocol.measurements(recording);
        let most = measurements.iter().copied().max().unwrap_or(1);
        // the longest windows that there are
        let longest = measurements.iter().copied().filter(|m| *m <= range.len()).max().unwrap_or(0);
        let mut press = Self {
            truth: Arc::new(truth),
            truths: Vec::new(),
            measured: match recording.taxels() > MANY_TAXELS {
                true => Measured::Few(few(recording, block, range, most)),
                false => Measured::Recorded(Press::new(recording, block, &session.protocol)),
            },
            protocol: &session.protocol,
            measurements_per_frame: recording.measurements_per_frame(),
        };
        press.truths = press.truths_of(longest);
        Some(press)
    }

    /// The truth of every window for images of up to `most` measurements.
    fn truths_of(&self, most: usize) -> Vec<Option<Truth>> {
        let samples = |press: &Press, range: Range<usize>| {
            let end = range.end.min(press.len());
            self.truth.without((range.start..end).filter_map(|k| press.window(k, 1)))
        };
        match &self.measured {
            Measured::Recorded(press) => {
                let starts = (0..press.len()).step_by(self.stride());
                starts.map(|start| samples(press, start..start + most)).collect()
            }
            Measured::Chosen([images, _]) => images.iter().map(|press| samples(press, 0..most)).collect(),
            Measured::Few(presses) => presses.iter().map(|press| samples(press, 0..most)).collect(),
        }
    }

    /// Measurements from the start of a window for images to that of the next one.
    fn stride(&self) -> usize {
        (self.protocol.support_stride * self.measurements_per_frame).max(1)
    }

    /// The same press, with windows of up to `most` measurements at rows that `chooser` chooses: those of classes for
    /// them only when `classes` are scored.
    ///
    /// # Errors
    /// [`Refusal`] when the rows have another number of taxels than what the chooser knows.
    pub(crate) fn chosen(&self, chooser: &RowChooser, most: usize, classes: bool) -> Result<Self, Refusal> {
        let measured = match &self.measured {
            Measured::Recorded(press) => {
                check_numbers(press)?;
                Measured::Chosen(chooser.windows(press, most, classes)?)
            }
            Measured::Chosen(windows) => Measured::Chosen(windows.clone()),
            Measured::Few(_) => {
                let problem = format!("rows are chosen on skins of at most {MANY_TAXELS} taxels");
                return Err(Refusal::new(problem));
            }
        };
        let mut chosen = Self { measured, truth: Arc::clone(&self.truth), truths: Vec::new(), ..*self };
        chosen.truths = chosen.truths_of(most);
        Ok(chosen)
    }

    /// The press, if its rows are there as numbers.
    ///
    /// # Errors
    /// [`Refusal`] if they are kept as bits alone.
    pub(crate) fn with_numbers(self) -> Result<Self, Refusal> {
        match &self.measured {
            Measured::Recorded(press) => check_numbers(press)?,
            Measured::Few(presses) => presses.iter().try_for_each(check_numbers)?,
            Measured::Chosen(_) => {}
        }
        Ok(self)
    }

    /// What is known of the true contact.
    pub(crate) fn truth(&self) -> &PressTruth {
        &self.truth
    }

    /// Windows of `m` measurements for the scores of images, and the truth of each.
    pub(crate) fn image_windows(&self, m: usize) -> (Vec<Window<'_>>, Vec<&Truth>) {
        let each: Vec<_> = match &self.measured {
            Measured::Recorded(press) => {
                let windows = press.windows(0..press.len(), m, self.stride());
                let truth = |start: usize| self.truths.get(start / self.stride())?.as_ref();
                windows.filter_map(|(start, window)| Some((window, truth(start)?))).collect()
            }
            Measured::Chosen([presses, _]) | Measured::Few(presses) => {
                let each = presses.iter().zip(&self.truths);
                each.filter_map(|(press, truth)| Some((press.window(0, m)?, truth.as_ref()?))).collect()
            }
        };
        each.into_iter().unzip()
    }

    /// Windows of `m` measurements for classes that need no vote, up to as many as the protocol scores.
    pub(crate) fn class_runs(&self, m: usize) -> Vec<Window<'_>> {
        match &self.measured {
            Measured::Recorded(press) => {
                let windows = press.windows(0..press.len(), m, m).map(|(_, w)| w);
                windows.take(self.protocol.max_windows).collect()
            }
            Measured::Chosen(_) | Measured::Few(_) => self.class_windows(m),
        }
    }

    /// Windows of `m` measurements for the scores of classes, in whole votes.
    fn class_windows(&self, m: usize) -> Vec<Window<'_>> {
        match &self.measured {
            Measured::Recorded(press) => {
                let count = self.protocol.windows(m, self.measurements_per_frame);
                press.windows(0..count * m, m, m).map(|(_, w)| w).collect()
            }
            Measured::Chosen([_, classes]) => classes.iter().filter_map(|press| press.window(0, m)).collect(),
            Measured::Few(presses) => presses.iter().filter_map(|press| press.window(0, m)).collect(),
        }
    }

    /// A press whose windows may be timed.
    pub(crate) fn first(&self) -> Option<&Press> {
        match &self.measured {
            Measured::Recorded(press) => Some(press),
            Measured::Chosen([images, _]) => images.first(),
            Measured::Few(presses) => presses.first(),
        }
    }
}

/// Refuses a press whose rows are kept as bits alone, for what needs them as numbers.
pub(crate) fn check_numbers(press: &Press) -> Result<(), Refusal> {
    if press.window(0, 1).is_none_or(|window| window.has_rows()) {
        return Ok(());
    }
    let rows = press.len();
    Err(Refusal::new(format!("{rows} rows of a skin of so many taxels are not kept as numbers, which are needed here")))
}

/// A trained decoder at work in one thread, with the classifier for images of decoders that name no class.
pub struct Scorer<'a> {
    algorithm: Box<dyn Algorithm + 'a>,
    classifier: &'a Src,
    work: Workspace,
}

impl<'a> Scorer<'a> {
    /// Starts `decoder`.
    pub fn new(decoder: &'a TrainedDecoder) -> Self {
        Self { algorithm: decoder.trained.start(), classifier: &decoder.classifier, work: Workspace::default() }
    }

    /// Answers of the decoder to `windows`, all of the same M, in order.
    ///
    /// # Errors
    /// [`DecodeError::External`] only. A window that cannot be solved has an empty answer.
    pub fn answers(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        self.algorithm.decode_all(windows)
    }

    /// The class of `answer`: the decoder's own, or that of the classifier for its image.
    pub fn class(&mut self, answer: &Answer) -> Option<usize> {
        match answer.class {
            Some(class) => class.label(),
            None => self.classifier.classify(&answer.image, &mut self.work).ok().flatten(),
        }
    }

    /// Scores a press by windows of `m` measurements: images by windows that the protocol spreads over the press;
    /// classes, of which `label` is the right one, by windows that follow each other. Both by windows of chosen rows
    /// where rows are chosen. Without a label no class is scored.
    ///
    /// # Errors
    /// [`DecodeError::External`] alone.
    pub(crate) fn score(
        &mut self,
        scored: &ScoredPress<'_>,
        m: usize,
        label: Option<usize>,
    ) -> Result<Tally, DecodeError> {
        let known = scored.truth();
        let mut tally = Tally::of(known);
        let (windows, truths) = scored.image_windows(m);
        for (answer, truth) in self.answers(&windows)?.iter().zip(truths) {
            tally.image_of(&answer.image, truth, known.raster.as_ref());
            // windows of the classes are counted below, and overlap with these
            tally.failed += usize::from(answer.failed && label.is_none());
        }
        if let Some(label) = label {
            self.score_classes(scored, m, label, &mut tally)?;
        }
        Ok(tally)
    }

    fn score_classes(
        &mut self,
        scored: &ScoredPress<'_>,
        m: usize,
        label: usize,
        tally: &mut Tally,
    ) -> Result<(), DecodeError> {
        let vote = scored.protocol.vote;
        let windows = scored.class_windows(m);
        let answers = self.answers(&windows)?;
        tally.failed += answers.iter().filter(|a| a.failed).count();
        let decisions: Vec<Option<usize>> = answers.iter().map(|a| self.class(a)).collect();
        tally.decisions(&decisions, label, vote);
        let groups = windows.chunks_exact(vote.max(1)).map(|group| {
            let mut rows = vec![Vec::new(); group.len()];
            let group: Vec<Window<'_>> = group.iter().zip(&mut rows).map(|(w, rows)| w.with_rows(rows)).collect();
            self.algorithm.sum(&group).map(Class::label)
        });
        let summed: Option<Vec<Option<usize>>> = groups.collect();
        tally.summed(&summed.unwrap_or_default(), label);
        Ok(())
    }
}

/// Windows that are timed at least, and the time after which no more are begun, s.
const FEWEST_TIMED: usize = 3;
const TIMING_S: f64 = 1.0;

/// Median time from a window to its answer, µs, on this thread, over up to `most` windows of the press, including Φ·D;
/// the mean for algorithms that decode in batches. `None` if the press is shorter than one window.
///
/// # Errors
/// [`DecodeError::External`] only.
pub fn decode_us(decoder: &TrainedDecoder, press: &Press, m: usize, most: usize) -> Result<Option<f64>, DecodeError> {
    let mut algorithm = decoder.trained.start();
    let windows = press.windows(0..press.len(), m, m).map(|(_, window)| window);
    let windows: Vec<Window<'_>> = windows.take(most).collect();
    if algorithm.batched() {
        let begin = Instant::now();
        black_box(algorithm.decode_all(&windows)?);
        let each_us = begin.elapsed().as_secs_f64() * 1e6 / windows.len() as f64;
        return Ok((!windows.is_empty()).then_some(each_us));
    }
    let mut answer = Answer::default();
    let mut times = Vec::with_capacity(windows.len());
    let mut rows = Vec::new();
    let all = Instant::now();
    for window in &windows {
        if times.len() >= FEWEST_TIMED && all.elapsed().as_secs_f64() > TIMING_S {
            break;
        }
        let window = if algorithm.takes_bits() { *window } else { window.with_rows(&mut rows) };
        let begin = Instant::now();
        let outcome = algorithm.decode(black_box(&window), &mut answer);
        let elapsed = begin.elapsed();
        black_box(&answer);
        match outcome {
            Err(error @ DecodeError::External(_)) => return Err(error),
            _ => times.push(elapsed.as_secs_f64() * 1e6),
        }
    }
    Ok(median(&times))
}
