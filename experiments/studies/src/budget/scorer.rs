//! Recording and scoring one press with one readout.

use super::size::{BudgetSize, compressive_take};
use super::skin::{LearnedSkin, Masks};
use super::tally::{Score, Tally};
use spts::twin::TwinError;
use spts_circuit::Profile;
use spts_eval::score::{Decode, Decoder, Learned, Projected, Projection, idle_mean};
use spts_recon::Workspace;
use std::sync::{Arc, OnceLock};

/// What all readouts of a skin share: its decodes, and Φ·D of every session.
pub(super) struct PressScorer<'a> {
    skin: &'a LearnedSkin,
    keys: &'a [(Decode, usize)],
    votes: usize,
    projections: Vec<OnceLock<Arc<Projection>>>,
}

impl<'a> PressScorer<'a> {
    /// Scores presses on `skin` by every decode and M of `keys`.
    pub(super) fn new(skin: &'a LearnedSkin, keys: &'a [(Decode, usize)], size: &BudgetSize) -> Self {
        Self {
            skin,
            keys,
            votes: size.votes,
            projections: vec![OnceLock::new(); size.sessions],
        }
    }

    /// Records compressive session `session` of object `object` with `profile` and scores it, key by key. Noise depends on object
    /// and session alone, so that two profiles are compared under the same noise.
    pub(super) fn score(&self, profile: &Profile, object: usize, session: usize) -> Result<Vec<Score>, TwinError> {
        let (skin, object) = (self.skin, &self.skin.objects[object]);
        let learned = &skin.learned[session];
        let chain = skin.chain.with_profile(profile.clone())?;
        let frames = skin.protocol.first_frame + skin.protocol.frames;
        let mut sources = [object.sources[session].clone()];
        let taxels = learned.dictionary.nrows();
        let duration_s = (frames * taxels) as f64 / chain.sample_rate_hz();
        let recording = chain.record_sources(&mut sources, duration_s, &compressive_take(object.label, session))?;
        let first = skin.protocol.first_frame.min(recording.frames());
        let projection = self.projections[session].get_or_init(|| {
            let per_frame = recording.measurements_per_frame();
            let rows = recording.rows(0, first * per_frame..recording.frames() * per_frame);
            Arc::new(Projection::new(rows, &learned.dictionary))
        });
        let volts = &recording.blocks()[0].volts[first * recording.measurements_per_frame()..];
        let idle = idle_mean(&recording, 0);
        let run = Projected::on(Arc::clone(projection), volts, idle);
        let mut scorer = WindowScorer {
            learned,
            masks: &object.masks,
            label: object.label,
            vote: skin.protocol.vote,
            votes: self.votes,
            decoder: Decoder::new(&learned.dictionary),
            work: Workspace::default(),
        };
        Ok(self
            .keys
            .iter()
            .map(|&(decode, m)| scorer.score(&run, decode, m))
            .collect())
    }
}

struct WindowScorer<'a> {
    learned: &'a Learned,
    masks: &'a Masks,
    label: usize,
    vote: usize,
    votes: usize,
    decoder: Decoder<'a>,
    work: Workspace,
}

impl WindowScorer<'_> {
    /// Votes of consecutive windows, spread evenly over the run; every window is scored and classified.
    fn score(&mut self, run: &Projected, decode: Decode, m: usize) -> Score {
        let vote_len = self.vote * m;
        let votes = self.votes.min(run.len() / vote_len);
        let mut tally = Tally::default();
        for vote in 0..votes {
            let start = vote * (run.len() - vote_len) / votes.saturating_sub(1).max(1);
            let mut decisions = Vec::with_capacity(self.vote);
            for window in 0..self.vote {
                if let Some(image) = self.decoder.decode(run, decode, start + window * m, m) {
                    tally.add(image, self.masks);
                    let decision = self.learned.classifier.classify(image, &mut self.work);
                    decisions.push(decision.unwrap_or_default());
                }
            }
            tally.vote(&decisions, self.label, self.vote);
        }
        tally.score()
    }
}
