//! Scores of one object's compressive session.

use super::decode::{Decode, Decoder, Projected};
use super::protocol::{Protocol, Truth};
use super::scored::ScoredSession;
use rayon::prelude::*;
use serde::Serialize;
use spts_recon::classify::{Library, Src, VoteScore, vote_groups};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::{Matrix, Workspace};

/// What a decoder has learned.
#[derive(Debug, Clone)]
pub struct Learned {
    /// Dictionary, taxels × atoms.
    pub dictionary: Matrix,
    /// Dictionary with its shifted copies, for contacts at places that were never learned.
    pub shifted: Matrix,
    /// Classifier.
    pub classifier: Src,
}

impl Learned {
    /// Decoder state from a dictionary, its shifted copies and a library.
    #[must_use]
    pub fn new(dictionary: Matrix, shifted: Matrix, library: Library) -> Self {
        Self {
            dictionary,
            shifted,
            classifier: Src::new(library, Src::PUBLISHED_SPARSITY),
        }
    }
}

/// One line of the board.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreRow {
    /// Object, or "mean".
    pub object: String,
    /// Decode, or "raster" for the control.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Support accuracy.
    pub support: f64,
    /// Intersection over union of the supports.
    pub iou: f64,
    /// F1 of the supports.
    pub f1: f64,
    /// Balanced accuracy of the supports.
    pub balanced_accuracy: f64,
    /// Share of single windows classified correctly.
    pub class_single: f64,
    /// Share of votes of 20 windows classified correctly.
    pub class_vote20: f64,
    /// The same with a vote list that is never cleared within a press, as the published script counts.
    pub class_cumulative: f64,
}

/// What one press contributes to one row.
#[derive(Default)]
pub(super) struct Partial {
    pub(super) support: Vec<SupportScore>,
    pub(super) decisions: Vec<Option<usize>>,
}

/// Scores every press of the session at every M with every decode. Presses run in parallel; the result does not depend on
/// the number of threads.
#[must_use]
pub fn score_compressive(
    session: &ScoredSession,
    learned: &Learned,
    measurements: &[usize],
    done: &(dyn Fn() + Sync),
) -> Vec<ScoreRow> {
    let protocol = &session.protocol;
    let Some(recording) = &session.compressive else {
        return Vec::new();
    };
    let presses: Vec<Vec<Partial>> = protocol
        .presses_of(recording)
        .into_par_iter()
        .filter_map(|block| Some((block, session.truth(block)?)))
        .map(|(block, truth)| {
            let projected = Projected::press(recording, block, protocol, &learned.dictionary);
            let mut scorer = PressScorer::new(&projected, learned, &truth, protocol);
            let partials = Decode::ALL
                .iter()
                .flat_map(|&decode| measurements.iter().map(move |&m| (decode, m)))
                .map(|(decode, m)| scorer.score(decode, m, recording.measurements_per_frame()))
                .collect();
            done();
            partials
        })
        .collect();
    let keys = Decode::ALL
        .iter()
        .flat_map(|d| measurements.iter().map(move |&m| (d.name(), m)));
    keys.enumerate()
        .filter_map(|(i, (decode, m))| {
            let partials: Vec<&Partial> = presses.iter().map(|p| &p[i]).collect();
            score_row(session, decode, m, &partials, protocol.vote)
        })
        .collect()
}

/// Joins the presses of a row; `None` without a window.
pub(super) fn score_row(
    session: &ScoredSession,
    decode: &'static str,
    m: usize,
    presses: &[&Partial],
    vote: usize,
) -> Option<ScoreRow> {
    let mut mean = MeanScore::default();
    let (mut single, mut voted, mut cumulative) = (VoteScore::default(), VoteScore::default(), VoteScore::default());
    for press in presses {
        press.support.iter().for_each(|s| mean.add(*s));
        single.add(&press.decisions, session.label);
        voted.add(&vote_groups(&press.decisions, vote, false), session.label);
        cumulative.add(&vote_groups(&press.decisions, vote, true), session.label);
    }
    let support = mean.mean()?;
    Some(ScoreRow {
        object: session.object.clone(),
        decode,
        m,
        support: support.accuracy,
        iou: support.iou,
        f1: support.f1,
        balanced_accuracy: support.balanced_accuracy,
        class_single: single.share()?,
        class_vote20: voted.share()?,
        class_cumulative: cumulative.share()?,
    })
}

struct PressScorer<'a> {
    projected: &'a Projected,
    learned: &'a Learned,
    truth: &'a Truth,
    protocol: &'a Protocol,
    decoder: Decoder<'a>,
    work: Workspace,
    mask: Vec<bool>,
}

impl<'a> PressScorer<'a> {
    fn new(projected: &'a Projected, learned: &'a Learned, truth: &'a Truth, protocol: &'a Protocol) -> Self {
        Self {
            projected,
            learned,
            truth,
            protocol,
            decoder: Decoder::new(&learned.dictionary),
            work: Workspace::default(),
            mask: Vec::new(),
        }
    }

    fn score(&mut self, decode: Decode, m: usize, per_frame: usize) -> Partial {
        let mut partial = Partial::default();
        let stride = self.protocol.support_stride * per_frame;
        for start in (0..self.projected.len()).step_by(stride) {
            if let Some(image) = self.decoder.decode(self.projected, decode, start, m) {
                support(image, SUPPORT_THRESHOLD, &mut self.mask);
                partial.support.push(SupportScore::new(&self.mask, &self.truth.support));
            }
        }
        for window in 0..self.protocol.windows(m, per_frame) {
            if let Some(image) = self.decoder.decode(self.projected, decode, window * m, m) {
                let decision = self.learned.classifier.classify(image, &mut self.work);
                partial.decisions.push(decision.unwrap_or_default());
            }
        }
        partial
    }
}

/// Mean of the rows of all objects, for every decode and M, in the order of the first object's rows.
#[must_use]
pub fn mean_rows(rows: &[ScoreRow]) -> Vec<ScoreRow> {
    let mut keys: Vec<(&'static str, usize)> = Vec::new();
    for row in rows {
        if !keys.contains(&(row.decode, row.m)) {
            keys.push((row.decode, row.m));
        }
    }
    keys.into_iter()
        .map(|(decode, m)| {
            let members: Vec<&ScoreRow> = rows.iter().filter(|r| r.decode == decode && r.m == m).collect();
            let mean = |get: fn(&ScoreRow) -> f64| members.iter().map(|r| get(r)).sum::<f64>() / members.len() as f64;
            ScoreRow {
                object: "mean".to_owned(),
                decode,
                m,
                support: mean(|r| r.support),
                iou: mean(|r| r.iou),
                f1: mean(|r| r.f1),
                balanced_accuracy: mean(|r| r.balanced_accuracy),
                class_single: mean(|r| r.class_single),
                class_vote20: mean(|r| r.class_vote20),
                class_cumulative: mean(|r| r.class_cumulative),
            }
        })
        .collect()
}

/// Score of an image that needs no measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineRow {
    /// Object, or "mean".
    pub object: String,
    /// "empty" or "`mean_image`".
    pub baseline: &'static str,
    /// Support accuracy.
    pub support: f64,
    /// Intersection over union.
    pub iou: f64,
    /// F1.
    pub f1: f64,
    /// Balanced accuracy.
    pub balanced_accuracy: f64,
}

/// Trivial baselines: an empty image, and the mean of all library images.
#[must_use]
pub fn baselines(sessions: &[ScoredSession], learned: &Learned) -> Vec<BaselineRow> {
    let library = learned.classifier.library();
    let mut mean_image = vec![0.0; library.images().nrows()];
    for (r, v) in mean_image.iter_mut().enumerate() {
        *v = library.images().row(r).iter().sum();
    }
    let mut masks = [("empty", vec![false; mean_image.len()]), ("mean_image", Vec::new())];
    support(&mean_image, SUPPORT_THRESHOLD, &mut masks[1].1);
    let mut rows: Vec<BaselineRow> = Vec::new();
    for (baseline, mask) in &masks {
        let mut mean = MeanScore::default();
        let row = |object: &str, s: SupportScore| BaselineRow {
            object: object.to_owned(),
            baseline,
            support: s.accuracy,
            iou: s.iou,
            f1: s.f1,
            balanced_accuracy: s.balanced_accuracy,
        };
        for (session, truth) in sessions.iter().filter_map(|s| Some((s, s.truth(0)?))) {
            let score = SupportScore::new(mask, &truth.support);
            mean.add(score);
            rows.push(row(&session.object, score));
        }
        if let Some(score) = mean.mean() {
            rows.push(row("mean", score));
        }
    }
    rows
}
