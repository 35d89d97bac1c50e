//! Everything the report says of one arm.

use super::latency::{LatencyRow, latency};
use super::tracking::{TraceRow, TrackingRow, traces, tracking};
use spts_eval::score::{Arm, BaselineRow, Board, Bounce, find_bounces, mean_rows};
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

/// Scores and curves of an arm.
#[derive(Debug, Clone)]
pub(super) struct SkinResults {
    /// The arm.
    pub(super) arm: Arm,
    /// Its board.
    pub(super) board: Board,
    /// Classification over time.
    pub(super) latency: Vec<LatencyRow>,
    /// Contacts of the ball.
    pub(super) bounces: Vec<Bounce>,
    /// Peak of every reconstructed frame of every contact.
    pub(super) traces: Vec<TraceRow>,
    /// What the number of measurements a frame does to it.
    pub(super) tracking: Vec<TrackingRow>,
}

impl SkinResults {
    /// Scores `arm`.
    #[must_use]
    pub(super) fn new(arm: Arm, measurements: &[usize], localisation: &[usize], done: &(dyn Fn() + Sync)) -> Self {
        let board = arm.score(measurements, localisation, done);
        let latency = latency(&arm);
        let bounces = arm.bounces.as_ref().map_or_else(Vec::new, find_bounces);
        let traces = arm
            .bounces
            .as_ref()
            .map_or_else(Vec::new, |recording| traces(recording, &bounces, &arm.learned.shifted));
        let tracking = tracking(&bounces, &traces);
        Self {
            arm,
            board,
            latency,
            bounces,
            traces,
            tracking,
        }
    }

    /// Objects with a compressive session.
    pub(super) fn compressive_objects(&self) -> impl Iterator<Item = &str> {
        let with = self.arm.sessions.iter().filter(|s| s.compressive.is_some());
        with.map(|s| s.object.as_str())
    }

    /// Adds the means over `objects` to the board, as object [`MEAN_COMMON`].
    pub(super) fn add_common_mean(&mut self, objects: &[String]) {
        if objects.is_empty() {
            return;
        }
        for baseline in ["empty", "mean_image"] {
            let found = self.board.baselines.iter().filter(|b| b.baseline == baseline);
            let of: Vec<BaselineRow> = found.filter(|b| objects.contains(&b.object)).cloned().collect();
            self.board.baselines.extend(mean_baseline(&of, baseline));
        }
        let rows: Vec<_> = self
            .board
            .rows
            .iter()
            .filter(|r| objects.contains(&r.object))
            .cloned()
            .collect();
        self.board.rows.extend(mean_rows(&rows).into_iter().map(|mut row| {
            MEAN_COMMON.clone_into(&mut row.object);
            row
        }));
    }

    /// Median duration of the ball's contacts as the recording shows them, ms.
    #[must_use]
    pub(super) fn contact_ms(&self) -> Option<f64> {
        let recording = self.arm.bounces.as_ref()?;
        let durations: Vec<f64> = self.bounces.iter().map(|b| b.duration_s(recording) * 1e3).collect();
        median(&durations)
    }
}
