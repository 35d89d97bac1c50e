//! The scorer: windows of a press go to an algorithm, and its answers into a tally.

use crate::algorithm::{Algorithm, Answer, Class, DecodeError};
use crate::decoders::TrainedDecoder;
use crate::protocol::{Protocol, Truth};
use crate::session::ScoredSession;
use crate::tally::Tally;
use crate::windows::{Press, Window};
use spts_recon::Workspace;
use spts_recon::classify::Src;

/// A press, and what is scored of it.
#[derive(Debug)]
pub(crate) struct ScoredPress<'a> {
    press: Press,
    truth: Truth,
    protocol: &'a Protocol,
    measurements_per_frame: usize,
}

impl<'a> ScoredPress<'a> {
    /// Block `block` of the compressive recording of `session`; `None` without that recording or a true image.
    pub(crate) fn new(session: &'a ScoredSession, block: usize) -> Option<Self> {
        let recording = session.compressive.as_ref()?;
        Some(Self {
            truth: session.truth(block)?,
            press: Press::new(recording, block, &session.protocol),
            protocol: &session.protocol,
            measurements_per_frame: recording.measurements_per_frame(),
        })
    }
}

/// A decoder at work for one thread.
pub struct Scorer<'a> {
    algorithm: Box<dyn Algorithm + 'a>,
    classifier: &'a Src,
    work: Workspace,
}

impl<'a> Scorer<'a> {
    /// Starts `decoder`.
    #[must_use]
    pub fn new(decoder: &'a TrainedDecoder) -> Self {
        Self {
            algorithm: decoder.trained.start(),
            classifier: &decoder.classifier,
            work: Workspace::default(),
        }
    }

    /// Answers of the decoder to `windows`, all of one M, in their order.
    ///
    /// # Errors
    /// [`DecodeError::External`] alone: a window that cannot be solved has an empty answer.
    pub fn answers(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        self.algorithm.decode_all(windows)
    }

    /// The class in `answer`: the decoder's own, or what the classifier makes of its image.
    pub fn class(&mut self, answer: &Answer) -> Option<usize> {
        match answer.class {
            Some(class) => class.label(),
            None => self.classifier.classify(&answer.image, &mut self.work).ok().flatten(),
        }
    }

    /// Scores `press` by windows of `m` measurements: images by windows that the protocol spreads over the press;
    /// classes, of which `label` is the right one, by windows that follow each other. Without a label no class is
    /// scored.
    ///
    /// # Errors
    /// [`DecodeError::External`] alone.
    pub(crate) fn score(
        &mut self,
        scored: &ScoredPress<'_>,
        m: usize,
        label: Option<usize>,
    ) -> Result<Tally, DecodeError> {
        let mut tally = Tally::default();
        let press = &scored.press;
        let stride = scored.protocol.support_stride * scored.measurements_per_frame;
        let windows: Vec<Window<'_>> = press.windows(0..press.len(), m, stride).map(|(_, w)| w).collect();
        for answer in self.answers(&windows)? {
            tally.image(&answer.image, &scored.truth.support);
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
        let count = scored.protocol.windows(m, scored.measurements_per_frame);
        let windows: Vec<Window<'_>> = scored.press.windows(0..count * m, m, m).map(|(_, w)| w).collect();
        let answers = self.answers(&windows)?;
        tally.failed += answers.iter().filter(|a| a.failed).count();
        let decisions: Vec<Option<usize>> = answers.iter().map(|a| self.class(a)).collect();
        tally.decisions(&decisions, label, vote);
        let groups = windows.chunks_exact(vote.max(1));
        let summed: Option<Vec<Option<usize>>> = groups
            .map(|group| self.algorithm.sum(group).map(Class::label))
            .collect();
        tally.summed(&summed.unwrap_or_default(), label);
        Ok(())
    }
}
