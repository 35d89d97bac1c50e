//! Rows of the exploration, as tables and in words.

use super::fit::{PowerLaw, power_law};
use super::wiring::{Way, Wiring};
use super::{WANTED_IOU, WANTED_LOCATED};
use serde::Serialize;
use spts_circuit::amplifier::Limit;

/// One number of measurements, means over the scenes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Trial {
    /// Measurements of every wire.
    pub rows_per_wire: usize,
    /// Measurements of all wires together, M.
    pub measurements: usize,
    /// Intersection over union of the supports.
    pub iou: f64,
    /// Share of the contacts found less than a taxel from where they are.
    pub located: f64,
    /// Bytes that recovery, operator and measurements hold, counted; the most of any scene.
    pub bytes: usize,
    /// Time of a recovery, s, with all threads.
    pub decode_s: f64,
}

impl Trial {
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

/// One size wired in one way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Taxels N.
    pub taxels: usize,
    /// Contacts of a scene.
    pub contacts: usize,
    /// How it is wired.
    pub way: Way,
    /// Wires.
    pub wires: usize,
    /// What fails by the amplifier's closed forms, if anything does.
    pub limit: Option<Limit>,
    /// Feedback resistance, Ω.
    pub feedback_ohm: f64,
    /// 1 + Rf·ΣG of the fullest wire.
    pub noise_gain: f64,
    /// Time to settle with slewing, s.
    pub settle_s: f64,
    /// Time of a measurement, s.
    pub period_s: f64,
    /// Signal of a fully pressed taxel over a step of the converter.
    pub steps_per_taxel: f64,
    /// Least number of measurements, of those tried, with the wanted IoU.
    pub m_iou: Option<usize>,
    /// Least number of measurements, of those tried, with the wanted share of contacts less than a taxel away.
    pub m_located: Option<usize>,
    /// Time to acquire the measurements for the IoU, all wires at once, s.
    pub acquire_s: Option<f64>,
    /// Time to scan every taxel of every wire at the same clock, s.
    pub raster_s: f64,
    /// Every number of measurements that was tried.
    pub trials: Vec<Trial>,
}

impl Row {
    pub(super) fn new(wiring: &Wiring, taxels: usize, contacts: usize, trials: Vec<Trial>) -> Self {
        let least = |aim: fn(&Trial) -> bool| trials.iter().filter(|t| aim(t)).min_by_key(|t| t.measurements);
        let iou = least(Trial::has_iou);
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
            m_located: least(Trial::has_located).map(|t| t.measurements),
            acquire_s: iou.map(|t| t.rows_per_wire as f64 * wiring.period_s),
            raster_s: taxels.div_ceil(wiring.wires) as f64 * wiring.period_s,
            trials,
        }
    }

    /// The trial with the wanted IoU and the fewest measurements, or the last one.
    pub(super) fn deciding(&self) -> Option<&Trial> {
        let found = self.trials.iter().find(|t| Some(t.measurements) == self.m_iou);
        found.or(self.trials.last())
    }

    /// The best IoU of all trials.
    fn best_iou(&self) -> f64 {
        self.trials.iter().map(|t| t.iou).fold(0.0, f64::max)
    }
}

/// A cost that grows as a power of the number of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    /// How the skin is wired.
    pub way: Way,
    /// What grows.
    pub cost: &'static str,
    /// The law, in taxels.
    #[serde(flatten)]
    pub law: PowerLaw,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Every size in every way.
    pub rows: Vec<Row>,
    /// Cost against size.
    pub fits: Vec<Fit>,
    /// Most taxels, pressed as in the first scene of the largest size, with which nothing fails on one wire as designed, by the closed forms.
    pub one_wire_taxels: Option<u32>,
}

/// A cost: its name, whether it is a time of this machine, and its value.
type Cost = (&'static str, bool, fn(&Row) -> Option<f64>);

/// Costs that are fitted.
const COSTS: [Cost; 5] = [
    ("measurements for the IoU", false, |r| r.m_iou.map(|m| m as f64)),
    ("measurements for the places", false, |r| r.m_located.map(|m| m as f64)),
    ("acquisition", false, |r| r.acquire_s),
    ("memory", false, |r| r.m_iou.and(r.deciding()).map(|t| t.bytes as f64)),
    (DECODING, true, |r| r.m_iou.and(r.deciding()).map(|t| t.decode_s)),
];

/// The cost that depends on the machine.
const DECODING: &str = "decoding";

/// A line of `explore.csv`.
#[derive(Debug, Serialize)]
pub(super) struct Line {
    taxels: usize,
    contacts: usize,
    way: Way,
    wires: usize,
    limit: &'static str,
    feedback_ohm: f64,
    noise_gain: f64,
    settle_s: f64,
    period_s: f64,
    steps_per_taxel: f64,
    m_iou: Option<usize>,
    m_located: Option<usize>,
    best_iou: f64,
    acquire_s: Option<f64>,
    raster_s: f64,
    bytes: Option<usize>,
}

/// A line of `trials.csv`.
#[derive(Debug, Serialize)]
pub(super) struct TrialLine {
    taxels: usize,
    way: Way,
    wires: usize,
    measurements: usize,
    iou: f64,
    located: f64,
    bytes: usize,
}

/// A line of `timings.csv`.
#[derive(Debug, Serialize)]
pub(super) struct TimingLine {
    taxels: usize,
    way: Way,
    measurements: usize,
    decode_s: f64,
}

/// A line of `fits.csv`.
#[derive(Debug, Serialize)]
pub(super) struct FitLine {
    way: Way,
    cost: &'static str,
    exponent: f64,
    exponent_se: f64,
    prefactor: f64,
    points: usize,
}

impl Report {
    /// Report of `rows`, with the fits that there are points enough for.
    pub(super) fn new(rows: Vec<Row>, one_wire_taxels: Option<u32>) -> Self {
        let mut fits = Vec::new();
        for way in Way::ALL {
            for (cost, _, value) in COSTS {
                let of = rows.iter().filter(|r| r.way == way);
                let points: Vec<_> = of.filter_map(|r| Some((r.taxels as f64, value(r)?))).collect();
                fits.extend(power_law(&points).map(|law| Fit { way, cost, law }));
            }
        }
        Self {
            rows,
            fits,
            one_wire_taxels,
        }
    }

    pub(super) fn lines(&self) -> Vec<Line> {
        let line = |r: &Row| Line {
            taxels: r.taxels,
            contacts: r.contacts,
            way: r.way,
            wires: r.wires,
            limit: r.limit.map_or("", Limit::name),
            feedback_ohm: r.feedback_ohm,
            noise_gain: r.noise_gain,
            settle_s: r.settle_s,
            period_s: r.period_s,
            steps_per_taxel: r.steps_per_taxel,
            m_iou: r.m_iou,
            m_located: r.m_located,
            best_iou: r.best_iou(),
            acquire_s: r.acquire_s,
            raster_s: r.raster_s,
            bytes: r.deciding().map(|t| t.bytes),
        };
        self.rows.iter().map(line).collect()
    }

    pub(super) fn trial_lines(&self) -> Vec<TrialLine> {
        let of_row = |r: &Row| {
            let (taxels, way, wires) = (r.taxels, r.way, r.wires);
            let line = |t: &Trial| TrialLine {
                taxels,
                way,
                wires,
                measurements: t.measurements,
                iou: t.iou,
                located: t.located,
                bytes: t.bytes,
            };
            r.trials.iter().map(line).collect::<Vec<_>>()
        };
        self.rows.iter().flat_map(of_row).collect()
    }

    pub(super) fn timing_lines(&self) -> Vec<TimingLine> {
        let of_row = |r: &Row| {
            let (taxels, way) = (r.taxels, r.way);
            let line = |t: &Trial| TimingLine {
                taxels,
                way,
                measurements: t.measurements,
                decode_s: t.decode_s,
            };
            r.trials.iter().map(line).collect::<Vec<_>>()
        };
        self.rows.iter().flat_map(of_row).collect()
    }

    /// Fits of times of this machine, or all the others.
    pub(super) fn fit_lines(&self, times: bool) -> Vec<FitLine> {
        let fits = self.fits.iter().filter(|f| (f.cost == DECODING) == times);
        fits.map(|f| FitLine {
            way: f.way,
            cost: f.cost,
            exponent: f.law.exponent,
            exponent_se: f.law.exponent_se,
            prefactor: f.law.prefactor,
            points: f.law.points,
        })
        .collect()
    }

    /// The table for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::from(
            "| taxels | readout               | wires | fails by          | M, IoU .8 | M/N %  | M, 1 px | best IoU | period µs | acquire ms | raster ms | decode ms | MB    |\n\
             |-------:|-----------------------|------:|-------------------|----------:|-------:|--------:|---------:|----------:|-----------:|----------:|----------:|------:|\n",
        );
        let or = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        for r in &self.rows {
            let trial = r.deciding();
            out.push_str(&format!(
                "| {:>6} | {:<21} | {:>5} | {:<17} | {:>9} | {:>6} | {:>7} | {:>8.3} | {:>9.1} | {:>10} | {:>9.1} | {:>9} | {:>5} |\n",
                r.taxels,
                r.way.name(),
                r.wires,
                r.limit.map_or("–", Limit::name),
                or(r.m_iou.map(|m| m.to_string())),
                or(r.m_iou.map(|m| format!("{:.2}", 100.0 * m as f64 / r.taxels as f64))),
                or(r.m_located.map(|m| m.to_string())),
                r.best_iou(),
                r.period_s * 1e6,
                or(r.acquire_s.map(|s| format!("{:.2}", s * 1e3))),
                r.raster_s * 1e3,
                or(trial.map(|t| format!("{:.1}", t.decode_s * 1e3))),
                or(trial.map(|t| format!("{:.1}", t.bytes as f64 / 1e6))),
            ));
        }
        if let Some(taxels) = self.one_wire_taxels {
            out.push_str(&format!(
                "\none wire as designed works up to {taxels} taxels pressed like this\n"
            ));
        }
        if !self.fits.is_empty() {
            out.push_str("\ncost ∝ taxels^p, p ± one standard error:\n");
        }
        for f in &self.fits {
            out.push_str(&format!(
                "{}, {}: {:.2} ± {:.2} ({} sizes)\n",
                f.way.name(),
                f.cost,
                f.law.exponent,
                f.law.exponent_se,
                f.law.points
            ));
        }
        out
    }
}
