//! Everything the report says of one skin.

use super::best::SHOWN;
use super::error::ReproduceError;
use super::latency::{LatencyRow, latency};
use super::tracking::{TraceRow, TrackingRow, traces, tracking};
use spts_eval::decoders::{PublishedDecode, TrainedDecoder};
use spts_eval::place::{PlaceRow, RecordedBounce, find_bounces};
use spts_eval::{BaselineRow, ScoredSkin, SkinScores, mean_rows};
use spts_recon::metrics::median;

/// Name of the mean over the objects that both skins were recorded with.
pub(super) const MEAN_COMMON: &str = "mean_common";

/// Mean of baseline rows, or `None` without one.
fn mean_baseline(rows: &[BaselineRow], baseline: &'static str) -> Option<BaselineRow> {
    let mean = |get: fn(&BaselineRow) -> f64| rows.iter().map(get).sum::<f64>() / rows.len() as f64;
    (!rows.is_empty()).then(|| BaselineRow {
        object: MEAN_COMMON.to_owned(),
        baseline,
        support: mean(|r| r.support),
        iou: mean(|r| r.iou),
        f1: mean(|r| r.f1),
        balanced_accuracy: mean(|r| r.balanced_accuracy),
    })
}

/// Scores and curves of a skin.
pub(super) struct SkinResults {
    /// The skin.
    pub(super) skin: ScoredSkin,
    /// Its scores.
    pub(super) scores: SkinScores,
    /// Its published decoder in the pictures.
    pub(super) matched: TrainedDecoder,
    /// Its best decoders, each beside its name.
    pub(super) best: Vec<(&'static str, TrainedDecoder)>,
    /// Classification over time.
    pub(super) latency: Vec<LatencyRow>,
    /// Contacts of the ball.
    pub(super) bounces: Vec<RecordedBounce>,
    /// Peak of every reconstructed frame of every contact.
    pub(super) traces: Vec<TraceRow>,
    /// Where the ball is by every locator.
    pub(super) places: Vec<PlaceRow>,
    /// What the number of measurements a frame does to it.
    pub(super) tracking: Vec<TrackingRow>,
}

impl SkinResults {
    /// Scores `skin`, by the published decoders and by its `best` ones.
    ///
    /// # Errors
    /// [`ReproduceError::Score`] when what was learned does not fit the skin.
    pub(super) fn new(
        skin: ScoredSkin,
        best: Vec<(&'static str, TrainedDecoder)>,
        measurements: &[usize],
        localisation: &[usize],
        done: &(dyn Fn() + Sync),
    ) -> Result<Self, ReproduceError> {
        let scores = skin.score(measurements, localisation, &best, done)?;
        let matched = PublishedDecode::Matched.decoder(&skin.learned)?;
        let latency = latency(&skin, &matched)?;
        let places = skin.ball_places(localisation)?;
        let (mut bounces, mut traces) = (Vec::new(), Vec::new());
        if let Some(recording) = &skin.bounces {
            bounces = find_bounces(recording);
            let matched = PublishedDecode::Matched.decoder(&skin.learned.at_all_places())?;
            traces = self::traces(recording, &bounces, &matched)?;
        }
        let tracking = tracking(&bounces, &traces);
        Ok(Self {
            skin,
            scores,
            matched,
            best,
            latency,
            places,
            bounces,
            traces,
            tracking,
        })
    }

    /// Objects with a compressive session.
    pub(super) fn compressive_objects(&self) -> impl Iterator<Item = &str> {
        let with = self.skin.sessions.iter().filter(|s| s.compressive.is_some());
        with.map(|s| s.object.as_str())
    }

    /// Adds the means over `objects` to the board, as object [`MEAN_COMMON`].
    pub(super) fn add_common_mean(&mut self, objects: &[String]) {
        if objects.is_empty() {
            return;
        }
        for baseline in ["empty", "mean_image"] {
            let found = self.scores.baselines.iter().filter(|b| b.baseline == baseline);
            let of: Vec<BaselineRow> = found.filter(|b| objects.contains(&b.object)).cloned().collect();
            self.scores.baselines.extend(mean_baseline(&of, baseline));
        }
        let rows: Vec<_> = self
            .scores
            .rows
            .iter()
            .filter(|r| objects.contains(&r.object))
            .cloned()
            .collect();
        self.scores.rows.extend(mean_rows(&rows).into_iter().map(|mut row| {
            MEAN_COMMON.clone_into(&mut row.object);
            row
        }));
    }

    /// Median duration of the ball's contacts as the recording shows them, ms.
    #[must_use]
    pub(super) fn contact_ms(&self) -> Option<f64> {
        let recording = self.skin.bounces.as_ref()?;
        let durations: Vec<f64> = self.bounces.iter().map(|b| b.duration_s(recording) * 1e3).collect();
        median(&durations)
    }

    /// Mean distance of the middle of the skin from the ball in the contacts that windows of `m` measurements fit into,
    /// taxels.
    #[must_use]
    pub(super) fn middle_px(&self, m: usize) -> Option<f64> {
        let middle = |r: &&PlaceRow| r.decoder == "middle" && !r.relabelled && r.m == m;
        self.places.iter().find(middle).map(|r| r.mean_px)
    }

    /// The decoder in the pictures beside the published one: its name and itself.
    pub(super) fn shown(&self) -> Option<(&'static str, &TrainedDecoder)> {
        let found = self.best.iter().find(|(name, _)| *name == SHOWN);
        found.map(|(name, decoder)| (*name, decoder))
    }
}
