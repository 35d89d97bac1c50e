//! The published evaluation of a skin.

use crate::board::{Entry, Run};
use crate::decoders::{RASTER, TrainedDecoder, published_decodes};
use crate::place::{BALL, LocalisationRow, PlaceRow, localise, places};
use crate::protocol::Truth;
use crate::sensing::Sensing;
use crate::session::ScoredSession;
use crate::source::ScoredSkin;
use crate::tally::{Tally, pool};
use crate::training::Learned;
use crate::unique;
use rayon::prelude::*;
use serde::Serialize;
use spts_input::Refusal;
use spts_recon::Workspace;
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::raster::Interpolation;

/// Scores of one skin by the published evaluation: what `spts validate` prints.
#[derive(Debug, Clone, Serialize)]
pub struct SkinScores {
    /// For every object, and for the mean over all objects (named "mean").
    pub rows: Vec<ScoreRow>,
    /// Localisation of the bouncing ball.
    pub localisation: Vec<LocalisationRow>,
    /// Trivial baselines.
    pub baselines: Vec<BaselineRow>,
}

impl ScoredSkin {
    /// Number of progress reports of [`ScoredSkin::score`].
    pub fn steps(&self) -> usize {
        self.sessions.iter().map(|s| s.scored().len() + 1).sum()
    }

    /// Scores the skin at every M of `measurements` by the published decodes and by the decoders in `more`, each beside
    /// its name, and the ball's place at every M of `localisation`; `done` is called after every press and every raster
    /// recording.
    ///
    /// # Errors
    /// [`Refusal`] if the trained dictionary or library does not fit the skin.
    pub fn score(
        &self,
        measurements: &[usize],
        localisation: &[usize],
        more: &[(&'static str, TrainedDecoder)],
        done: &(dyn Fn() + Sync),
    ) -> Result<SkinScores, Refusal> {
        let mut decoders = published_decodes(&self.learned)?;
        decoders.extend(more.iter().cloned());
        let sessions: Vec<&ScoredSession> = self.sessions.iter().collect();
        let compressive = score_sessions(&sessions, &decoders, measurements, done)?;
        let raster = self.sessions.iter().flat_map(|session| {
            let rows = score_raster(session, &self.learned, measurements);
            done();
            rows
        });
        let raster: Vec<ScoreRow> = raster.collect();
        let located = match &self.bounces {
            Some(recording) => localise(recording, &self.learned.shifted, self.learned.cols, localisation)?,
            None => Vec::new(),
        };
        let means = [mean_rows(&compressive), mean_rows(&raster)].concat();
        Ok(SkinScores {
            rows: [compressive, raster, means].concat(),
            localisation: located,
            baselines: baselines(&self.sessions, &self.learned),
        })
    }

    /// The ball's place at every M of `measurements` by every locator, as recorded and with the taxels relabelled; none
    /// without a ball.
    ///
    /// # Errors
    /// [`Refusal`] when the sheet is no grid or no rows can be chosen.
    pub fn ball_places(&self, measurements: &[usize]) -> Result<Vec<PlaceRow>, Refusal> {
        let Some(recording) = &self.bounces else {
            return Ok(Vec::new());
        };
        let shifted = self.learned.shifted.clone();
        places(BALL, recording, shifted, self.learned.cols, measurements, &[Sensing::Random])
    }
}

impl SkinScores {
    /// Row of `object` ("mean" for the mean) for variant `decode` and `m`.
    pub fn row(&self, object: &str, decode: &str, m: usize) -> Option<&ScoreRow> {
        let found = |r: &&ScoreRow| r.object == object && r.decode == decode && r.m == m;
        self.rows.iter().find(found)
    }

    /// Localisation row for variant `decode` and `m`.
    pub fn located(&self, decode: &str, m: usize) -> Option<&LocalisationRow> {
        self.localisation.iter().find(|r| r.decode == decode && r.m == m)
    }
}

/// Scores of one object with one decoding variant and M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreRow {
    /// Object, or "mean".
    pub object: String,
    /// Decoding variant, or "raster" for the control.
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
    /// Share of correct votes with a list of decisions that is never cleared within a press, as in the published
    /// script.
    pub class_cumulative: f64,
}

impl ScoreRow {
    /// The scores of the presses of `session`; `None` when a score is missing, as without a window.
    fn new(session: &ScoredSession, decode: &'static str, m: usize, presses: &[Tally]) -> Option<Self> {
        let scores = pool(presses);
        Some(Self {
            object: session.title().to_owned(),
            decode,
            m,
            support: scores.support?,
            iou: scores.iou?,
            f1: scores.f1?,
            balanced_accuracy: scores.balanced_accuracy?,
            class_single: scores.class_single?,
            class_vote20: scores.class_vote20?,
            class_cumulative: scores.class_cumulative?,
        })
    }
}

/// Scores every press of `sessions` at every M with every decoder, each beside its name: the board with decoders that
/// are trained already. `done` is called after every press.
///
/// # Errors
/// [`Refusal`] of an external program.
pub fn score_sessions(
    sessions: &[&ScoredSession],
    decoders: &[(&'static str, TrainedDecoder)],
    measurements: &[usize],
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ScoreRow>, Refusal> {
    let run = Run { sessions: sessions.to_vec(), measurements: measurements.to_vec(), times: false, by_raster: true };
    let entries = decoders.iter().map(|(name, decoder)| Entry::published(name, decoder, sessions.len()));
    let tallies = run.tallies(&entries.collect::<Vec<_>>(), done)?;
    let slots = decoders.iter().flat_map(|(decode, _)| measurements.iter().map(move |&m| (*decode, m)));
    let slots: Vec<_> = slots.zip(tallies).collect();
    let of_session = |(at, session): (usize, &&ScoredSession)| {
        let rows = slots.iter().filter_map(|((decode, m), tallies)| ScoreRow::new(session, decode, *m, &tallies[at]));
        rows.collect::<Vec<_>>()
    };
    Ok(sessions.iter().enumerate().flat_map(of_session).collect())
}

/// Mean over all objects for every decoding variant and M, in the order of the first object's rows.
pub fn mean_rows(rows: &[ScoreRow]) -> Vec<ScoreRow> {
    let keys = unique(rows.iter().map(|row| (row.decode, row.m)));
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

/// Scores the raster recording of an object at every M.
pub fn score_raster(session: &ScoredSession, learned: &Learned, measurements: &[usize]) -> Vec<ScoreRow> {
    let Some(recording) = &session.raster else {
        return Vec::new();
    };
    let protocol = &session.raster_protocol;
    let truth = Truth::new(recording, protocol);
    let cols = learned.cols;
    let rows = recording.taxels() / cols.max(1);
    measurements
        .par_iter()
        .filter_map(|&m| {
            let interpolation = Interpolation::evenly_spaced(rows, cols, m);
            let mut image = vec![0.0; recording.taxels()];
            let mut work = Workspace::default();
            let presses: Vec<Tally> = protocol
                .presses_of(recording)
                .map(|block| {
                    let (mut tally, mut decisions) = (Tally::default(), Vec::new());
                    let last = (protocol.first_frame + protocol.frames).min(recording.frames());
                    for frame in protocol.first_frame..last {
                        interpolation.apply(recording.volts(block, frame), &mut image);
                        tally.image(&image, &truth.support);
                        let decision = learned.classifier.classify(&image, &mut work);
                        decisions.push(decision.unwrap_or_default());
                    }
                    tally.decisions(&decisions, session.label, protocol.vote);
                    tally
                })
                .collect();
            ScoreRow::new(session, RASTER, m, &presses)
        })
        .collect()
}

/// Scores that an image without any measurement gets on one object: a decoder has to be better.
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

/// Scores of trivial baselines: an empty image, and the mean of all library images.
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
        for (session, truth) in sessions.iter().filter_map(|s| Some((s, s.raster_truth()?))) {
            let score = SupportScore::new(mask, &truth.support);
            mean.add(score);
            rows.push(row(session.title(), score));
        }
        if let Some(score) = mean.mean() {
            rows.push(row("mean", score));
        }
    }
    rows
}
