//! Number of measurements that a large skin needs, on one or several wires, including the limits of the electronics.

use crate::electronics::ElectronicsStudy;
use crate::wiring::{Wiring, wirings};
use scene::{ExploreScene, MeasuredWires, located, scene};
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::Seeding;
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::matrix_free::RegionPursuit;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use std::time::Instant;

mod scene;

pub use crate::wiring::Way;

/// Wanted IoU.
pub(crate) const WANTED_IOU: f64 = 0.8;
/// Wanted share of contacts found within less than a taxel of their true place.
pub(crate) const WANTED_LOCATED: f64 = 0.95;
/// Rounds of a recovery.
const MAX_ROUNDS: usize = 10;
/// Measurements a contact at which the search begins: it has four unknowns, place, width and peak.
const FIRST_PER_CONTACT: usize = 8;
/// The search ends at this share of the taxels, or at this many measurements where that is more.
const MOST: (f64, usize) = (0.05, 1000);

/// Settings of `spts explore`, which finds how many measurements large skins need.
#[derive(Debug, Clone, Serialize)]
pub struct ExploreStudy {
    /// Sides of the square skins, taxels.
    pub sides: Vec<u32>,
    /// Number of scenes for each size.
    pub scenes: u64,
    /// Seeds of the cells.
    pub seeding: Seeding,
    /// Whether M is only doubled, without a trial between the last two values.
    pub quick: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl ExploreStudy {
    /// Explores every size with every wiring. All values except times are the same for any number of threads.
    ///
    /// # Errors
    /// [`Refusal`] if the electronics cannot be built, or a wire cannot be measured.
    pub fn run(&self, progress: &dyn Progress) -> Result<ExploreReport, Refusal> {
        let electronics = ElectronicsStudy::as_designed()?;
        let pressed_s = electronics.skin.pressed_s;
        progress.stage("exploring", Some(self.sides.len() * Way::ALL.len()));
        let mut rows = Vec::new();
        for &side in &self.sides {
            let scenes: Vec<ExploreScene> =
                (0..self.scenes).map(|index| scene(side as usize, pressed_s, Streams::new(self.seed), index)).collect();
            let Some(first) = scenes.first() else { continue };
            for wiring in wirings(&first.image_s, self.seeding, &electronics)? {
                rows.push(self.search(side as usize, wiring, &scenes, &electronics)?);
                progress.step();
            }
        }
        progress.end();
        Ok(ExploreReport::new(rows, electronics.largest_on_one_wire()?))
    }

    /// Raises M until both aims are reached or the end of the search.
    fn search(
        &self,
        side: usize,
        wiring: Wiring,
        scenes: &[ExploreScene],
        electronics: &ElectronicsStudy,
    ) -> Result<SizeRow, Refusal> {
        let streams = Streams::new(self.seed);
        let mut measured = Vec::with_capacity(scenes.len());
        for (index, scene) in (0..).zip(scenes) {
            let streams = streams.child("explore/skin", index);
            measured.push(MeasuredWires::new(&wiring, scene, electronics.skin.idle_s, streams)?);
        }
        let taxels = side * side;
        let most = most_measurements(taxels).div_ceil(wiring.wires);
        let contacts = scenes.first().map_or(1, |scene| scene.contacts);
        let mut rows = (FIRST_PER_CONTACT * contacts).div_ceil(wiring.wires).max(8).min(most);
        let mut at = |rows| trial(side, &wiring, scenes, &mut measured, rows);
        let mut trials: Vec<ExploreTrial> = Vec::new();
        loop {
            trials.push(at(rows)?);
            let reached = |aim: fn(&ExploreTrial) -> bool| trials.iter().any(aim);
            if rows == most || (reached(ExploreTrial::has_iou) && reached(ExploreTrial::has_located)) {
                break;
            }
            rows = (2 * rows).min(most);
        }
        let aims = [ExploreTrial::has_iou, ExploreTrial::has_located];
        for aim in aims.into_iter().filter(|_| !self.quick) {
            // half an octave below the least M that reaches the aim
            let least = trials.iter().filter(|t| aim(t)).map(|t| t.rows_per_wire).min();
            #[expect(clippy::cast_possible_truncation, reason = "thousands of rows")]
            let between = least.map(|rows| (rows as f64 * std::f64::consts::FRAC_1_SQRT_2).round() as usize);
            if let Some(rows) = between.filter(|rows| trials.iter().all(|t| t.rows_per_wire != *rows) && *rows >= 4) {
                trials.push(at(rows)?);
                trials.sort_by_key(|t| t.rows_per_wire);
            }
        }
        let [iou, located] = aims.map(|aim| trials.iter().filter(|t| aim(t)).min_by_key(|t| t.measurements));
        Ok(SizeRow {
            taxels,
            contacts,
            m_iou: iou.map(|t| t.measurements),
            m_located: located.map(|t| t.measurements),
            acquire_s: iou.map(|t| t.rows_per_wire as f64 * wiring.period_s),
            raster_s: taxels.div_ceil(wiring.wires) as f64 * wiring.period_s,
            wiring,
            trials,
        })
    }
}

/// Measurements at which the search ends.
#[expect(clippy::cast_possible_truncation, reason = "skins stay far below 2^52 taxels")]
fn most_measurements(taxels: usize) -> usize {
    let share = (taxels as f64 * MOST.0).round() as usize;
    share.max(MOST.1).min(taxels)
}

/// `rows` measurements a wire of every scene, recovered and scored.
fn trial(
    side: usize,
    wiring: &Wiring,
    scenes: &[ExploreScene],
    measured: &mut [MeasuredWires],
    rows: usize,
) -> Result<ExploreTrial, Refusal> {
    let pursuit = RegionPursuit { max_rounds: MAX_ROUNDS, ..RegionPursuit::new(side, side) };
    let mut sum = ExploreTrial { rows_per_wire: rows, measurements: rows * wiring.wires, ..ExploreTrial::default() };
    let share = 1.0 / scenes.len() as f64;
    let (mut truth, mut mask) = (Vec::new(), Vec::new());
    for (scene, measured) in scenes.iter().zip(measured) {
        let (phi, volts) = measured.first(rows)?;
        let time = Instant::now();
        let found = pursuit.recover(&phi, &volts, None)?;
        sum.decode_s += share * time.elapsed().as_secs_f64();
        support(&scene.image_s, SUPPORT_THRESHOLD, &mut truth);
        support(&found.image, SUPPORT_THRESHOLD, &mut mask);
        sum.iou += share * SupportScore::new(&mask, &truth).iou;
        sum.located += share * located(&found.image, &scene.image_s, side);
        let operator: usize = phi.parts().iter().map(|part| part.inner().bytes()).sum();
        sum.bytes = sum.bytes.max(found.bytes + operator + size_of_val(&volts[..]));
    }
    Ok(sum)
}

/// Results with one number of measurements; means over the scenes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
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
    /// Whether the IoU is as wanted.
    fn has_iou(&self) -> bool {
        self.iou >= WANTED_IOU
    }

    /// Whether the contacts are where they should be.
    fn has_located(&self) -> bool {
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
    /// Wires, electronics and clock.
    #[serde(flatten)]
    pub wiring: Wiring,
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
    /// The trial with the wanted IoU and the fewest measurements; otherwise the last one.
    pub fn deciding(&self) -> Option<&ExploreTrial> {
        let found = self.trials.iter().find(|t| Some(t.measurements) == self.m_iou);
        found.or(self.trials.last())
    }

    /// The best IoU of all trials.
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
    fn new(rows: Vec<SizeRow>, one_wire_taxels: Option<u32>) -> Self {
        let mut fits = Vec::new();
        for way in Way::ALL {
            for (cost, value) in COSTS {
                let of = rows.iter().filter(|r| r.wiring.way == way);
                let points: Vec<_> = of.filter_map(|r| Some((r.taxels as f64, value(r)?))).collect();
                fits.extend(power_law(&points).map(|law| CostFit { way, cost, law }));
            }
        }
        Self { rows, fits, one_wire_taxels }
    }
}

/// y = prefactor · x^exponent, by least squares of the logarithms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    /// Exponent.
    pub exponent: f64,
    /// Standard error of the exponent, from the scatter about the line.
    pub exponent_se: f64,
    /// y at x = 1.
    pub prefactor: f64,
    /// Number of points.
    pub points: usize,
}

/// Power law through points above 0; `None` for fewer than 3 of them, or all at one x.
fn power_law(points: &[(f64, f64)]) -> Option<PowerLaw> {
    let logs = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite());
    let logs: Vec<(f64, f64)> = logs.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let sxx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let sxy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    if logs.len() < 3 || sxx <= 0.0 {
        return None;
    }
    let exponent = sxy / sxx;
    let rest: f64 = logs.iter().map(|(x, y)| (y - my - exponent * (x - mx)).powi(2)).sum();
    Some(PowerLaw {
        exponent,
        exponent_se: (rest / (n - 2.0) / sxx).sqrt(),
        prefactor: (my - exponent * mx).exp(),
        points: logs.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything but the times, from one thread and from three.
    #[test]
    fn any_number_of_threads_gives_the_same_numbers() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let explore = ExploreStudy { sides: vec![20], scenes: 2, seeding: Seeding::Mixed, quick: false, seed: 5 };
        let rows = |threads: usize| -> Vec<SizeRow> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let scenes: Vec<ExploreScene> = (0..2).map(|i| scene(20, 150e-6, Streams::new(5), i)).collect();
            let wirings = wirings(&scenes[0].image_s, Seeding::Mixed, &electronics).unwrap();
            let search = |wiring: Wiring| explore.search(20, wiring, &scenes, &electronics).unwrap();
            let mut rows: Vec<SizeRow> = pool.install(|| wirings.into_iter().map(search).collect());
            rows.iter_mut().flat_map(|r| &mut r.trials).for_each(|t| t.decode_s = 0.0);
            rows
        };
        let (one, three) = (rows(1), rows(3));
        assert_eq!(one, three);
        // an ideal wire needs far fewer measurements than there are taxels
        assert!(one[0].m_iou.is_some_and(|m| m < 200) && one[0].m_located.is_some(), "{:?}", one[0]);
    }

    #[test]
    fn a_power_law_is_found_with_its_error() {
        let points: Vec<(f64, f64)> = [1.0, 10.0, 100.0, 1e3].map(|x: f64| (x, 3.0 * x.powf(1.5))).to_vec();
        let law = power_law(&points).unwrap();
        // logarithms of numbers up to 1e5, rounded
        assert!((law.exponent - 1.5).abs() < 1e-13 && (law.prefactor - 3.0).abs() < 1e-12 && law.exponent_se < 1e-13);
        // by hand: logs at 0, 1, 2 with values 0, 1, 1: slope ½, residuals −1/6, 1/3, −1/6, their squares sum to 1/6,
        // Sxx = 2
        let e = std::f64::consts::E;
        let law = power_law(&[(1.0, 1.0), (e, e), (e * e, e)]).unwrap();
        assert!((law.exponent - 0.5).abs() < 1e-14 && (law.exponent_se - (1.0_f64 / 12.0).sqrt()).abs() < 1e-14);
        assert_eq!(power_law(&points[..2]), None);
    }
}
