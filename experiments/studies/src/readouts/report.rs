//! Results of the benchmark.

use super::published::{PUBLISHED, PublishedSystem};
use serde::Serialize;
use spts_recon::statistics::Band;

/// IoU from which an image counts as good: the wanted IoU of large skins in [`explore`](crate::explore).
pub const GOOD_IOU: f64 = crate::explore::WANTED_IOU;

/// The clock for skins of one size, the same for all readouts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeWire {
    /// Taxels N.
    pub taxels: usize,
    /// Duration of a measurement, s.
    pub period_s: f64,
}

/// One readout with one number of measurements; bands over the repetitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReadoutTrial {
    /// Number of measurements for an image, M.
    pub measurements: usize,
    /// Images a second with the common clock.
    pub frames_hz: f64,
    /// Intersection over union of the supports, for shapes at random places.
    pub iou: Option<Band>,
    /// Distance of the centres, taxels, for the shapes with a non-empty image.
    pub place_px: Option<Band>,
    /// Share of the seventeen objects that are classified correctly.
    pub accuracy: Option<Band>,
    /// Mean time from a touch at a random moment to a sample beyond the alarm threshold, s, for the touches that are
    /// noticed.
    pub noticed_s: Option<Band>,
    /// Mean time from a touch until its place is known, s.
    pub placed_s: Option<Band>,
    /// Share of the shapes with an empty image.
    pub lost: f64,
    /// Share of the shapes without a sample beyond the alarm threshold.
    pub unnoticed: f64,
}

impl ReadoutTrial {
    /// Whether the mean IoU is good.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.iou.is_some_and(|iou| iou.mean >= GOOD_IOU)
    }
}

/// Results of one readout method on skins of one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutRow {
    /// Name.
    pub readout: &'static str,
    /// Name in figures.
    #[serde(skip)]
    pub label: &'static str,
    /// Number of measured wires.
    pub wires: usize,
    /// Taxels N.
    pub taxels: usize,
    /// Largest feedback resistance for which its sums fit, Ω.
    pub feedback_ohm: f64,
    /// One entry for each number of measurements, in increasing order.
    pub trials: Vec<ReadoutTrial>,
}

impl ReadoutRow {
    /// The trial with the fewest measurements and a good image; otherwise the one with the best IoU.
    #[must_use]
    pub fn deciding(&self) -> Option<&ReadoutTrial> {
        let iou = |t: &ReadoutTrial| t.iou.map_or(0.0, |iou| iou.mean);
        let best = self.trials.iter().max_by(|a, b| iou(a).total_cmp(&iou(b)));
        self.trials.iter().find(|t| t.is_good()).or(best)
    }
}

/// Results of `spts readouts`: all readout methods on skins of all sizes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutsReport {
    /// The clock of every size.
    pub wires: Vec<SizeWire>,
    /// Ordered by size, then in the order of the table.
    pub rows: Vec<ReadoutRow>,
    /// Figures stated by published systems.
    pub published: &'static [PublishedSystem],
}

impl Default for ReadoutsReport {
    fn default() -> Self {
        Self {
            wires: Vec::new(),
            rows: Vec::new(),
            published: PUBLISHED,
        }
    }
}
