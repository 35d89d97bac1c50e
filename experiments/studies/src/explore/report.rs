//! Results of an exploration: every size with every wiring, and how the costs grow.

use super::fit::{PowerLaw, power_law};
use super::wiring::{Way, Wiring};
use super::{WANTED_IOU, WANTED_LOCATED};
use serde::Serialize;
use spts_circuit::amplifier::Limit;

/// Results with one number of measurements; means over the scenes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExploreTrial {
    /// Number of measurements of every wire.
    pub rows_per_wire: usize,
    /// Number of measurements of all wires together, M.
    pub measurements: usize,
    /// Intersection over union of the supports.
    pub iou: f64,
    /// Share of the contacts found within less than a taxel of their true place.
    pub located: f64,
    /// Memory of recovery, operator and measurements, bytes; the largest of all scenes.
    pub bytes: usize,
    /// Time of a recovery with all threads, s.
    pub decode_s: f64,
}

impl ExploreTrial {
    /// Nothing added up yet.
    pub(super) fn none(rows_per_wire: usize, measurements: usize) -> Self {
        Self {
            rows_per_wire,
            measurements,
            iou: 0.0,
            located: 0.0,
            bytes: 0,
            decode_s: 0.0,
        }
    }

    /// Whether the IoU is as wanted.
    pub(super) fn has_iou(&self) -> bool {
        self.iou >= WANTED_IOU
    }

    /// Whether the contacts are where they should be.
    pub(super) fn has_located(&self) -> bool {
        self.located >= WANTED_LOCATED
    }
}

/// What a skin of one size needs with one kind of wiring: electronics, measurements, time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SizeRow {
    /// Taxels N.
    pub taxels: usize,
    /// Number of contacts in a scene.
    pub contacts: usize,
    /// Wiring.
    pub way: Way,
    /// Wires.
    pub wires: usize,
    /// Limit that the amplifier's closed forms show as exceeded; `None` if there is none.
    pub limit: Option<Limit>,
    /// Feedback resistance, Ω.
    pub feedback_ohm: f64,
    /// 1 + Rf·ΣG of the wire with the most taxels.
    pub noise_gain: f64,
    /// Settling time including slewing, s.
    pub settle_s: f64,
    /// Duration of a measurement, s.
    pub period_s: f64,
    /// Signal of a fully pressed taxel, in steps of the converter.
    pub steps_per_taxel: f64,
    /// Smallest number of measurements, among those tried, with the wanted IoU.
    pub m_iou: Option<usize>,
    /// Smallest number of measurements, among those tried, with the wanted share of located contacts.
    pub m_located: Option<usize>,
    /// Time of the measurements for the wanted IoU, all wires in parallel, s.
    pub acquire_s: Option<f64>,
    /// Time to scan every taxel of every wire at the same clock, s.
    pub raster_s: f64,
    /// Every number of measurements that was tried.
    pub trials: Vec<ExploreTrial>,
}

impl SizeRow {
    pub(super) fn new(wiring: &Wiring, taxels: usize, contacts: usize, trials: Vec<ExploreTrial>) -> Self {
        let least = |aim: fn(&ExploreTrial) -> bool| trials.iter().filter(|t| aim(t)).min_by_key(|t| t.measurements);
        let iou = least(ExploreTrial::has_iou);
        Self {
            taxels,
            contacts,
            way: wiring.way,
            wires: wiring.wires,
            limit: wiring.limit,
            feedback_ohm: wiring.feedback_ohm,
            noise_gain: wiring.noise_gain,
            settle_s: wiring.settle_s,
            period_s: wiring.period_s,
            steps_per_taxel: wiring.steps_per_taxel,
            m_iou: iou.map(|t| t.measurements),
            m_located: least(ExploreTrial::has_located).map(|t| t.measurements),
            acquire_s: iou.map(|t| t.rows_per_wire as f64 * wiring.period_s),
            raster_s: taxels.div_ceil(wiring.wires) as f64 * wiring.period_s,
            trials,
        }
    }

    /// The trial with the wanted IoU and the fewest measurements; otherwise the last one.
    #[must_use]
    pub fn deciding(&self) -> Option<&ExploreTrial> {
        let found = self.trials.iter().find(|t| Some(t.measurements) == self.m_iou);
        found.or(self.trials.last())
    }

    /// The best IoU of all trials.
    #[must_use]
    pub fn best_iou(&self) -> f64 {
        self.trials.iter().map(|t| t.iou).fold(0.0, f64::max)
    }
}

/// A cost as a power law of the number of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CostFit {
    /// Wiring.
    pub way: Way,
    /// Name of the cost.
    pub cost: &'static str,
    /// The power law.
    #[serde(flatten)]
    pub law: PowerLaw,
}

impl CostFit {
    /// Whether the cost is a computing time on this machine.
    #[must_use]
    pub fn is_of_this_machine(&self) -> bool {
        self.cost == DECODING
    }
}

/// Results of `spts explore`: what skins of growing size need.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExploreReport {
    /// Every size in every way.
    pub rows: Vec<SizeRow>,
    /// Costs as functions of size.
    pub fits: Vec<CostFit>,
    /// Largest number of taxels with which nothing fails on one wire with the electronics of `as_designed`, by the
    /// closed forms and for the pressed skin of `spts circuit`:
    /// [`ElectronicsStudy::largest_on_one_wire`](crate::electronics::ElectronicsStudy). It does not depend on the sizes
    /// in the study.
    pub one_wire_taxels: Option<u32>,
}

/// A cost: its name and its value.
type Cost = (&'static str, fn(&SizeRow) -> Option<f64>);

/// Costs that are fitted.
const COSTS: [Cost; 5] = [
    ("measurements for the IoU", |r| r.m_iou.map(|m| m as f64)),
    ("measurements for the places", |r| r.m_located.map(|m| m as f64)),
    ("acquisition", |r| r.acquire_s),
    ("memory", |r| r.m_iou.and(r.deciding()).map(|t| t.bytes as f64)),
    (DECODING, |r| r.m_iou.and(r.deciding()).map(|t| t.decode_s)),
];

/// The cost that depends on the machine.
const DECODING: &str = "decoding";

impl ExploreReport {
    /// Report of `rows`, with the fits that there are points enough for.
    pub(super) fn new(rows: Vec<SizeRow>, one_wire_taxels: Option<u32>) -> Self {
        let mut fits = Vec::new();
        for way in Way::ALL {
            for (cost, value) in COSTS {
                let of = rows.iter().filter(|r| r.way == way);
                let points: Vec<_> = of.filter_map(|r| Some((r.taxels as f64, value(r)?))).collect();
                fits.extend(power_law(&points).map(|law| CostFit { way, cost, law }));
            }
        }
        Self {
            rows,
            fits,
            one_wire_taxels,
        }
    }
}
