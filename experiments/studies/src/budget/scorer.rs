//! Records and scores one press with one readout.

use super::score::PressScores;
use super::size::{BudgetSize, compressive_acquisition};
use super::skin::LearnedSkin;
use spts_circuit::Profile;
use spts_eval::decoders::{PublishedDecode, TrainedDecoder};
use spts_eval::{Press, ScoreError, Scorer, Tally, Window, idle_mean};
use spts_input::Refusal;

/// What all readouts of a skin share: its decoders, one set a session.
pub(super) struct PressScorer<'a> {
    skin: &'a LearnedSkin,
    keys: &'a [(PublishedDecode, usize)],
    votes: usize,
    decoders: Vec<Vec<(PublishedDecode, TrainedDecoder)>>,
}

impl<'a> PressScorer<'a> {
    /// Scores presses on `skin` by every decode and M of `keys`.
    ///
    /// # Errors
    /// [`Refusal`] when a decode cannot use what was learned.
    pub(super) fn new(
        skin: &'a LearnedSkin,
        keys: &'a [(PublishedDecode, usize)],
        size: &BudgetSize,
    ) -> Result<Self, Refusal> {
        let decoders = skin.learned.iter().map(PublishedDecode::decoders);
        Ok(Self {
            skin,
            keys,
            votes: size.votes,
            decoders: decoders.collect::<Result<_, _>>().map_err(Refusal::from_error)?,
        })
    }

    /// Records compressive session `session` of object `object` with `profile` and scores it, key by key. Noise depends
    /// on object and session alone, so that two profiles are compared under the same noise.
    pub(super) fn score(&self, profile: &Profile, object: usize, session: usize) -> Result<Vec<PressScores>, Refusal> {
        let (skin, object) = (self.skin, &self.skin.objects[object]);
        let chain = skin.chain.with_profile(profile.clone()).map_err(Refusal::from_error)?;
        let frames = skin.protocol.first_frame + skin.protocol.frames;
        let mut sources = [object.sources[session].clone()];
        let taxels = skin.learned[session].dictionary.atoms.nrows();
        let duration_s = (frames * taxels) as f64 / chain.sample_rate_hz();
        let recording = chain
            .record_sources(
                &mut sources,
                duration_s,
                &compressive_acquisition(object.label, session),
            )
            .map_err(Refusal::from_error)?;
        let per_frame = recording.measurements_per_frame();
        let (idle_v, vote) = (idle_mean(&recording, 0), skin.protocol.vote);
        let [first, end] =
            [skin.protocol.first_frame.min(recording.frames()), recording.frames()].map(|f| f * per_frame);
        let score = |&(decode, m): &(PublishedDecode, usize)| {
            let mut tallies: [Tally; 3] = Default::default();
            for (_, decoder) in self.decoders[session].iter().filter(|(d, _)| *d == decode) {
                let mut scorer = Scorer::new(decoder);
                for start in self.starts(end - first, m).map(|start| first + start) {
                    // vote by vote, because the weights of a whole press on a large skin fill the memory
                    let press = Press::within(&recording, 0, start..start + vote * m, idle_v);
                    let windows: Vec<Window<'_>> = press.windows(0..press.len(), m, m).map(|(_, w)| w).collect();
                    let answers = scorer
                        .answers(&windows)
                        .map_err(ScoreError::from)
                        .map_err(Refusal::from_error)?;
                    for answer in &answers {
                        for (tally, truth) in tallies.iter_mut().zip(&object.masks) {
                            tally.image(&answer.image, truth);
                        }
                    }
                    let decisions: Vec<Option<usize>> = answers.iter().map(|a| scorer.class(a)).collect();
                    tallies[0].decisions(&decisions, object.label, vote);
                }
            }
            Ok(PressScores::new(&tallies))
        };
        self.keys.iter().map(score).collect()
    }

    /// First measurements of the votes, spread evenly over a press of `len` measurements.
    fn starts(&self, len: usize, m: usize) -> impl Iterator<Item = usize> {
        let vote_len = self.skin.protocol.vote * m;
        let votes = self.votes.min(len / vote_len);
        (0..votes).map(move |vote| vote * (len - vote_len) / votes.saturating_sub(1).max(1))
    }
}
